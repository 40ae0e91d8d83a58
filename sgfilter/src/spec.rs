//! What a filter computes: window, polynomial order, look-ahead and derivative.

use crate::Error;

/// Shortest window, in samples.
pub const MIN_WINDOW: usize = 2;
/// Longest window, in samples.
pub const MAX_WINDOW: usize = 255;

/// A valid choice of window, polynomial order, look-ahead and derivative.
///
/// ```
/// use sgfilter::Spec;
///
/// let spec = Spec::new(7, 2, 1, 0)?; // 7 samples, parabola, one sample of look-ahead, smoothing
/// assert_eq!(spec.look_ahead(), 1);
/// assert!(Spec::new(7, 7, 1, 0).is_err());
/// # Ok::<(), sgfilter::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Spec {
    window: usize,
    order: usize,
    look_ahead: usize,
    derivative: usize,
}

impl Spec {
    /// Checks and keeps the four numbers.
    ///
    /// - `window`: samples per fit, [`MIN_WINDOW`]`..=`[`MAX_WINDOW`].
    /// - `order`: degree of the fitted polynomial, below `window`.
    /// - `look_ahead`: samples newer than the evaluated one, below `window`. 0 is causal: the newest
    ///   sample is evaluated and nothing is delayed. `(window - 1) / 2` is the classic centred filter.
    /// - `derivative`: 0 smooths, 1 gives the speed, 2 the acceleration; at most `order`.
    ///
    /// # Errors
    /// [`Error::Window`], [`Error::Order`], [`Error::LookAhead`] or [`Error::Derivative`].
    pub fn new(
        window: usize,
        order: usize,
        look_ahead: usize,
        derivative: usize,
    ) -> Result<Self, Error> {
        if !(MIN_WINDOW..=MAX_WINDOW).contains(&window) {
            return Err(Error::Window { window });
        }
        if order >= window {
            return Err(Error::Order { order, window });
        }
        if look_ahead >= window {
            return Err(Error::LookAhead { look_ahead, window });
        }
        if derivative > order {
            return Err(Error::Derivative { derivative, order });
        }
        Ok(Self {
            window,
            order,
            look_ahead,
            derivative,
        })
    }

    /// Samples per fit.
    pub fn window(&self) -> usize {
        self.window
    }

    /// Degree of the fitted polynomial.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Samples newer than the evaluated one: the delay of a stream, in samples.
    pub fn look_ahead(&self) -> usize {
        self.look_ahead
    }

    /// Which derivative of the polynomial is evaluated.
    pub fn derivative(&self) -> usize {
        self.derivative
    }

    /// Index of the evaluated sample in a full window, counted from the oldest.
    pub(crate) fn position(&self) -> usize {
        self.window - 1 - self.look_ahead
    }
}
