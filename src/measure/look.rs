//! Looks of knobs in plots, on paper and in the window: a color and a shape, so that no two are alike.

/// Colors in turn: those of Okabe and Ito, to be told apart by the color-blind, and three darker ones.
pub(crate) const COLORS: [[u8; 3]; 10] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [51, 34, 136],
    [230, 159, 0],
    [86, 180, 233],
    [120, 20, 70],
    [110, 130, 20],
    [120, 120, 120],
];

/// The shape of a mark, all of them closed: they can be filled or hollow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MarkShape {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
    Left,
    Right,
}

/// Shapes in turn. As many as have no divisor in common with the number of colors: only after 70 knobs does a look
/// come again.
const SHAPES: [MarkShape; 7] = [
    MarkShape::Circle,
    MarkShape::Square,
    MarkShape::Up,
    MarkShape::Diamond,
    MarkShape::Down,
    MarkShape::Left,
    MarkShape::Right,
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct KnobLook {
    pub(crate) color: [u8; 3],
    pub(crate) shape: MarkShape,
}

/// The look of the knob with this number in its stage.
pub(crate) fn look(k: usize) -> KnobLook {
    KnobLook { color: COLORS[k % COLORS.len()], shape: SHAPES[k % SHAPES.len()] }
}

impl MarkShape {
    /// Corners of the shape around the origin, y down, as far from it as a circle of radius 1 looks; none of a circle.
    pub(crate) fn corners(self) -> &'static [[f64; 2]] {
        match self {
            Self::Circle => &[],
            Self::Square => &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
            Self::Diamond => &[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]],
            Self::Up => &[[0.0, -1.2], [1.15, 0.9], [-1.15, 0.9]],
            Self::Down => &[[0.0, 1.2], [-1.15, -0.9], [1.15, -0.9]],
            Self::Left => &[[-1.2, 0.0], [0.9, -1.15], [0.9, 1.15]],
            Self::Right => &[[1.2, 0.0], [-0.9, 1.15], [-0.9, -1.15]],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE L*a*b* under D65.
    fn lab(color: [u8; 3]) -> [f64; 3] {
        let linear = color.map(|v| f64::from(v) / 255.0).map(|v| match v {
            v if v <= 0.04045 => v / 12.92,
            v => ((v + 0.055) / 1.055).powf(2.4),
        });
        let row = |m: [f64; 3]| m.iter().zip(linear).map(|(m, v)| m * v).sum::<f64>();
        let xyz = [
            row([0.4124, 0.3576, 0.1805]) / 0.9505,
            row([0.2126, 0.7152, 0.0722]),
            row([0.0193, 0.1192, 0.9505]) / 1.089,
        ];
        let [x, y, z] = xyz.map(|t| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn apart(a: [u8; 3], b: [u8; 3]) -> f64 {
        lab(a).iter().zip(lab(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn no_two_of_seventy_knobs_look_alike() {
        let looks: Vec<KnobLook> = (0..70).map(look).collect();
        assert!((0..70).all(|i| (0..i).all(|j| looks[i] != looks[j])));
        // The control: there are 70 looks, and no more.
        assert_eq!(look(70), look(0));
        // The first seven differ in both, neighbors always do.
        assert!((0..7).all(|i| (0..i).all(|j| looks[i].color != looks[j].color && looks[i].shape != looks[j].shape)));
        assert!(looks.windows(2).all(|w| w[0].color != w[1].color && w[0].shape != w[1].shape));
    }

    #[test]
    fn colors_are_told_apart_and_seen_on_white() {
        for (i, a) in COLORS.iter().enumerate() {
            assert!(apart(*a, [255; 3]) > 30.0, "{a:?} on white");
            // Ten times what is just seen side by side.
            assert!(COLORS[..i].iter().all(|b| apart(*a, *b) > 23.0), "{a:?} is like another");
        }
    }
}
