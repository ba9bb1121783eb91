"""The measurements behind every claim in docs/benchmarks.md; `posebridge bench` runs them."""
