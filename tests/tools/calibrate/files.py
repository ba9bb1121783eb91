"""Calibrations written by hand as other programs write theirs."""

KALIBR = """\
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.2871, 0.0812, -0.00021, 1.14e-05]
  distortion_model: radtan
  intrinsics: [471.25, 470.75, 361.5, 245.25]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.0, -1.0, 0.0, -0.11]
  - [1.0, 0.0, 0.0, 0.02]
  - [0.0, 0.0, 1.0, 0.003]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.29560, 0.08617, 5.6e-05, 0.00011]
  distortion_model: radtan
  intrinsics: [460.06, 458.78, 373.35, 253.73]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
"""
ROS = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [441.783, 0.000000, 306.593, 0.000000, 439.302, 244.738, 0.000000, 0.000000, 1.000000]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.351976, 0.111510, 0.001114, 0.000605, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [0.999978, 0.002789, -0.006046, -0.002816, 0.999986, -0.004401, 0.006034, 0.004417, 0.999972]
projection_matrix:
  rows: 3
  cols: 4
  data: [395.65, 0.000000, 321.79, 0.000000, 0.000000, 395.65, 242.09, 0, 0, 0, 1.0, 0.0]
"""
EUROC = """\
# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, -0.02,
         1.0, 0.0, 0.0, -0.06,
         0.0, 0.0, 1.0, 0.01,
         0.0, 0.0, 0.0, 1.0]

# Camera specific definitions.
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [451.25, 450.5, 366.125, 247.75] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.2612, 0.0701, 0.00021, 1.7e-05]
"""
OPENCV = """\
%YAML:1.0
---
calibration_time: "Mon Jun  3 10:12:44 2024"
nframes: 13
image_width: 640
image_height: 480
board_width: 9
board_height: 6
square_size: 1.
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 532.795, 0., 342.4584, 0., 532.9194, 233.9010, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.28108, 0.02519, 1.2153e-03, -1.3553e-04, 0.16361 ]
avg_reprojection_error: 0.1954
"""
OPENCV_STEREO = """\
%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 533., 0., 342., 0., 533., 234., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 14
   dt: d
   data: [ -0.28, 0.1, 0., 0., 0., 0., 0., 0.2, 0., 0., 0., 0., 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 537., 0., 327., 0., 537., 249., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.28, 0.1, 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 0., -1., 0., 1., 0., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -3.3, 0.04, 0.05 ]
"""
