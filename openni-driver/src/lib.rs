//! A driver for OpenNI2 that shows a simulated depth sensor as a real device.
