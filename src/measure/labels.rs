//! Labels beside the points of a plot, where they hide neither each other nor a point as far as there is room.

/// A rectangle: least corner and size, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LabelBox {
    pub(crate) min: [f32; 2],
    pub(crate) size: [f32; 2],
}

impl LabelBox {
    fn max(&self) -> [f32; 2] {
        [self.min[0] + self.size[0], self.min[1] + self.size[1]]
    }

    /// The area that both have in common.
    pub(crate) fn overlap(&self, other: &Self) -> f32 {
        let (a, b) = (self.max(), other.max());
        let along = |k: usize| (a[k].min(b[k]) - self.min[k].max(other.min[k])).max(0.0);
        along(0) * along(1)
    }

    /// The point of its border, or inside, that is nearest to another.
    pub(crate) fn nearest(&self, to: [f32; 2]) -> [f32; 2] {
        let max = self.max();
        [0, 1].map(|k| to[k].clamp(self.min[k], max[k]))
    }
}

/// Half the side of what a point itself takes.
const MARK: f32 = 6.0;
/// Distances from the point at which a label is tried.
const REACHES: [f32; 8] = [9.0, 16.0, 26.0, 40.0, 58.0, 80.0, 108.0, 140.0];
/// Directions: right first, then above and below, left at last.
const TURNS: [f32; 12] = [0.0, -30.0, 30.0, -60.0, 60.0, -90.0, 90.0, -120.0, 120.0, -150.0, 150.0, 180.0];
/// Factor by which area outside of the frame counts more than area under another label.
const OUTSIDE: f32 = 20.0;
/// Cost of a unit of distance, in units of hidden area.
const FAR: f32 = 1.0;

/// A place for a label of each of these sizes beside its point, within `frame`. Labels come in the order that is given:
/// earlier ones get the nearer places.
pub(crate) fn place(points: &[[f32; 2]], sizes: &[[f32; 2]], frame: LabelBox) -> Vec<LabelBox> {
    let marks: Vec<LabelBox> =
        points.iter().map(|p| LabelBox { min: p.map(|v| v - MARK), size: [2.0 * MARK; 2] }).collect();
    let mut placed: Vec<LabelBox> = Vec::with_capacity(points.len());
    for (point, size) in points.iter().zip(sizes) {
        let mut best = (f32::INFINITY, LabelBox { min: *point, size: *size });
        'search: for reach in REACHES {
            for turn in TURNS {
                let label = beside(*point, *size, reach, turn);
                let hidden: f32 = placed.iter().chain(&marks).map(|other| label.overlap(other)).sum();
                let outside = size[0] * size[1] - label.overlap(&frame);
                let cost = hidden + OUTSIDE * outside + FAR * reach;
                if cost < best.0 {
                    best = (cost, label);
                }
            }
            // Farther away is worse than here, whatever is there.
            if best.0 <= FAR * reach + 1e-3 {
                break 'search;
            }
        }
        placed.push(best.1);
    }
    placed
}

/// The label of this size whose nearest border is `reach` away from `point` in a direction, degrees from the right
/// downward.
fn beside(point: [f32; 2], size: [f32; 2], reach: f32, turn: f32) -> LabelBox {
    let (sin, cos) = turn.to_radians().sin_cos();
    // The side that is turned to the point slides along as the direction turns.
    let x = point[0] + reach * cos + size[0] * (0.5 * cos - 0.5);
    let y = point[1] + reach * sin + size[1] * (0.5 * sin - 0.5);
    LabelBox { min: [x, y], size }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: LabelBox = LabelBox { min: [0.0; 2], size: [700.0, 460.0] };

    fn hidden(labels: &[LabelBox], points: &[[f32; 2]]) -> f32 {
        let marks = points.iter().map(|p| LabelBox { min: p.map(|v| v - MARK), size: [2.0 * MARK; 2] });
        let under: f32 = marks.map(|m| labels.iter().map(|l| l.overlap(&m)).sum::<f32>()).sum();
        let each = |i: usize| labels[..i].iter().map(|o| o.overlap(&labels[i])).sum::<f32>();
        under + (0..labels.len()).map(each).sum::<f32>()
    }

    #[test]
    fn labels_of_a_crowd_hide_nothing() {
        // 24 points, most of them in two heaps, as settings of a knob are that changes little.
        let heap = |n: usize, x: f32, y: f32| (0..n).map(move |k| [x + 7.0 * (k % 4) as f32, y + 9.0 * (k / 4) as f32]);
        let points: Vec<[f32; 2]> =
            heap(10, 300.0, 200.0).chain(heap(8, 500.0, 380.0)).chain(heap(6, 60.0, 40.0)).collect();
        let sizes: Vec<[f32; 2]> = (0..24).map(|k| [50.0 + 4.0 * (k % 10) as f32, 13.0]).collect();
        let labels = place(&points, &sizes, FRAME);
        assert_eq!(hidden(&labels, &points), 0.0, "{labels:?}");
        assert!(labels.iter().zip(&sizes).all(|(l, s)| (l.overlap(&FRAME) - s[0] * s[1]).abs() < 0.5), "all inside");
        // The control: labels that are all to the right of their points hide a good deal.
        let naive: Vec<LabelBox> = points.iter().zip(&sizes).map(|(p, s)| beside(*p, *s, 9.0, 0.0)).collect();
        assert!(hidden(&naive, &points) > 2_000.0);
    }

    #[test]
    fn a_label_alone_is_right_of_its_point_and_turns_at_the_border() {
        let size = [60.0, 12.0];
        let one = place(&[[100.0, 100.0]], &[size], FRAME)[0];
        assert_eq!((one.min, one.nearest([100.0, 100.0])), ([109.0, 94.0], [109.0, 100.0]));
        let border = place(&[[690.0, 100.0]], &[size], FRAME)[0];
        assert!(border.max()[0] <= 700.0 && border.nearest([690.0, 100.0]) != [690.0, 100.0], "{border:?}");
    }

    #[test]
    fn more_than_there_is_room_for_are_placed_all_the_same() {
        let points = vec![[20.0, 10.0]; 30];
        let frame = LabelBox { min: [0.0; 2], size: [60.0, 30.0] };
        assert_eq!(place(&points, &vec![[40.0, 12.0]; 30], frame).len(), 30);
    }
}
