"""From sightings to the vehicle's state: the estimator and its parts."""
