//! Laws of the metrics: a perfect run is perfect, and a known fault gives a known figure.
