//! Just enough drawing for the report's plots: axes with round ticks, lines, dots, text. Colours are classes; the
//! page's style sheet gives them, for light and dark.

use std::fmt::Write;

/// How many colours there are; methods beyond begin again.
pub(super) const COLOURS: usize = 8;
/// Room of a label.
const LABEL_WIDE: f64 = 110.0;
const LABEL_HIGH: f64 = 13.0;

/// Text that may stand in HTML and SVG, also in attributes.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' => {}
            c => out.push(c),
        }
    }
    out
}

/// A number as short as it can be told.
pub(super) fn number(value: f64) -> String {
    let digits = match value.abs() {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// One direction of a plot.
pub(super) struct Axis {
    /// What it shows, with the unit.
    pub(super) label: String,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Whether equal ways are equal ratios.
    pub(super) logarithmic: bool,
}

impl Axis {
    /// From 0 to a little more than the largest of `values`.
    pub(super) fn from_zero(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let high = values.filter(|v| v.is_finite()).fold(0.0, f64::max);
        Self {
            label: label.to_owned(),
            low: 0.0,
            high: if high > 0.0 { high * 1.05 } else { 1.0 },
            logarithmic: false,
        }
    }

    /// Where `value` lies: 0 to 1, beyond that outside of the plot.
    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value.max(1e-9).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    fn ticks(&self) -> Vec<f64> {
        if self.logarithmic {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let of_decade = |decade: i32| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(decade));
            return decades
                .flat_map(of_decade)
                .filter(|v| (self.low..=self.high).contains(v))
                .collect();
        }
        let rough = (self.high - self.low) / 5.0;
        let decade = 10_f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 2.5, 5.0, 10.0].map(|m| m * decade);
        let step = steps
            .into_iter()
            .find(|s| *s >= rough)
            .unwrap_or(decade * 10.0);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// A plot under way.
pub(super) struct Plot {
    size: [f64; 2],
    /// Left, top, right, bottom.
    margin: [f64; 4],
    x: Axis,
    y: Axis,
    body: String,
    /// Where labels stand.
    labels: Vec<[f64; 2]>,
}

impl Plot {
    /// An empty plot with its axes. `title` is what a screen reader says.
    pub(super) fn new(title: &str, size: [f64; 2], x: Axis, y: Axis) -> Self {
        let mut plot = Self {
            size,
            margin: [52.0, 12.0, 16.0, 40.0],
            x,
            y,
            body: format!("<title>{}</title>", escaped(title)),
            labels: Vec::new(),
        };
        plot.axes();
        plot
    }

    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, top, right, bottom] = self.margin;
        let (wide, high) = (self.size[0] - left - right, self.size[1] - top - bottom);
        [
            left + wide * self.x.share(x),
            top + high * (1.0 - self.y.share(y)),
        ]
    }

    fn axes(&mut self) {
        let [left, top, right, bottom] = self.margin;
        let [width, height] = self.size;
        for tick in self.x.ticks() {
            let [x, _] = self.at(tick, self.y.low);
            let (y1, y2) = (top, height - bottom);
            self.put(format_args!(
                "<line class=grid x1={x:.1} x2={x:.1} y1={y1} y2={y2} /><text class=tick x={x:.1} y={} text-anchor=middle>{}</text>",
                y2 + 15.0,
                number(tick)
            ));
        }
        for tick in self.y.ticks() {
            let [_, y] = self.at(self.x.low, tick);
            self.put(format_args!(
                "<line class=grid x1={left} x2={} y1={y:.1} y2={y:.1} /><text class=tick x={} y={:.1} text-anchor=end>{}</text>",
                width - right,
                left - 6.0,
                y + 4.0,
                number(tick)
            ));
        }
        let (x, y) = (left + (width - left - right) / 2.0, height - 6.0);
        let labels = (escaped(&self.x.label), escaped(&self.y.label));
        self.put(format_args!(
            "<text class=axis x={x:.1} y={y} text-anchor=middle>{}</text>",
            labels.0
        ));
        let middle = top + (height - top - bottom) / 2.0;
        self.put(format_args!(
            "<text class=axis transform='translate(13 {middle:.1}) rotate(-90)' text-anchor=middle>{}</text>",
            labels.1
        ));
    }

    fn put(&mut self, what: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(what);
    }

    /// A line through points, in colour number `series`; what lies outside of the plot is not shown.
    pub(super) fn line(&mut self, series: usize, name: &str, points: &[(f64, f64)]) {
        let mut path = String::new();
        for (x, y) in points
            .iter()
            .filter(|(x, y)| x.is_finite() && y.is_finite())
        {
            let [x, y] = self.at(*x, *y);
            let _ = write!(
                path,
                "{}{x:.1} {y:.1}",
                if path.is_empty() { "M" } else { "L" }
            );
        }
        if !path.is_empty() {
            let colour = series % COLOURS;
            let [left, top, right, bottom] = self.margin;
            let (wide, high) = (self.size[0] - left - right, self.size[1] - top - bottom);
            self.put(format_args!(
                "<svg class=clip x={left} y={top} width={wide} height={high} viewBox='{left} {top} {wide} {high}'>\
                 <path class='line s{colour}' d='{path}'><title>{}</title></path></svg>",
                escaped(name)
            ));
        }
    }

    /// A dashed line across the plot at the height of `y`, in colour number `series`, with `label` on it.
    pub(super) fn level(&mut self, series: usize, name: &str, y: f64, label: &str) {
        let [left, _, right, _] = self.margin;
        let end = self.size[0] - right;
        let [_, y] = self.at(self.x.low, y);
        let colour = series % COLOURS;
        self.put(format_args!(
            "<path class='line level s{colour}' d='M{left} {y:.1}L{end} {y:.1}'><title>{}</title></path>\
             <text class=label x={:.1} y={:.1} text-anchor=end>{}</text>",
            escaped(name),
            end - 4.0,
            y - 5.0,
            escaped(label)
        ));
    }

    /// A dot with a text that shows when one points at it; `label` stands beside it, clear of earlier ones.
    pub(super) fn dot(&mut self, series: usize, name: &str, at: (f64, f64), label: &str) {
        let [x, y] = self.at(at.0, at.1);
        let colour = series % COLOURS;
        self.put(format_args!(
            "<circle class='dot s{colour}' cx={x:.1} cy={y:.1} r=5><title>{}</title></circle>",
            escaped(name)
        ));
        let mut below = y + 4.0;
        while self
            .labels
            .iter()
            .any(|[lx, ly]| (lx - x).abs() < LABEL_WIDE && (ly - below).abs() < LABEL_HIGH)
        {
            below += LABEL_HIGH;
        }
        self.labels.push([x, below]);
        let right = x < self.size[0] * 0.75;
        let (dx, anchor) = if right { (9.0, "start") } else { (-9.0, "end") };
        self.put(format_args!(
            "<text class=label x={:.1} y={below:.1} text-anchor={anchor}>{}</text>",
            x + dx,
            escaped(label)
        ));
    }

    /// The drawing.
    pub(super) fn finish(self) -> String {
        let [width, height] = self.size;
        format!(
            "<svg role=img viewBox='0 0 {width} {height}' preserveAspectRatio='xMidYMid meet'>{}</svg>",
            self.body
        )
    }
}
