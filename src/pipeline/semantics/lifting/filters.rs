//! The paper's filters, which sort a segmenter's masks into objects and their parts.
//!
//! Objects: largest first, each is painted on an empty canvas if its place is free. Parts of an object: smallest
//! first, on a canvas of the object's own; hollow masks are background seen around other things, not parts.

use crate::scene::Mask;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FilterOptions {
    /// Share of a mask's pixels that may be taken already; it loses those pixels. 0 is the paper's rule.
    pub(crate) taken: f64,
    /// Share of a part that may lie outside its object; it loses those pixels.
    pub(crate) outside: f64,
    /// Largest share of holes in the area that a part's outline encloses.
    pub(crate) hollow: f64,
    /// Least share of its object from which a part is the object itself.
    pub(crate) whole: f64,
}

impl Default for FilterOptions {
    fn default() -> Self {
        Self { taken: 0.0, outside: 0.1, hollow: 0.5, whole: 0.9 }
    }
}

/// A mask that was kept, less the pixels it lost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kept {
    pub(crate) index: usize,
    pub(crate) mask: Mask,
}

/// The masks that are objects: disjoint, largest first. Of masks of one size the first goes first.
pub(crate) fn objects(masks: &[Mask], options: &FilterOptions) -> Vec<Kept> {
    let mut order: Vec<(usize, usize)> = masks.iter().map(Mask::area).enumerate().map(|(i, a)| (a, i)).collect();
    order.sort_by_key(|&(area, i)| (std::cmp::Reverse(area), i));
    paint(order.into_iter().map(|(_, i)| Kept { index: i, mask: masks[i].clone() }), options)
}

/// The masks that are parts of `object`: disjoint, inside it, smallest first.
pub(crate) fn parts(object: &Mask, masks: &[Mask], options: &FilterOptions) -> Vec<Kept> {
    let whole = options.whole * object.area() as f64;
    let inside = |(index, mask): (usize, &Mask)| {
        let own = mask.overlap(object);
        let kept = own > 0 && own as f64 >= (1.0 - options.outside) * mask.area() as f64 && (own as f64) < whole;
        (kept && hollowness(mask) <= options.hollow).then(|| {
            let mut clipped = mask.clone();
            clipped.intersect(object);
            Kept { index, mask: clipped }
        })
    };
    let mut order: Vec<Kept> = masks.iter().enumerate().filter_map(inside).collect();
    order.sort_by_key(|k| (k.mask.area(), masks[k.index].area(), k.index));
    paint(order.into_iter(), options)
}

/// Paints masks one after another on an empty canvas.
fn paint(masks: impl Iterator<Item = Kept>, options: &FilterOptions) -> Vec<Kept> {
    let mut canvas: Option<Mask> = None;
    let mut kept = Vec::new();
    for mut found in masks {
        let canvas = canvas.get_or_insert_with(|| Mask::empty(found.mask.width_px(), found.mask.height_px()));
        let (area, taken) = (found.mask.area(), found.mask.overlap(canvas));
        if area == taken || taken as f64 > options.taken * area as f64 {
            continue;
        }
        found.mask.subtract(canvas);
        canvas.add(&found.mask);
        kept.push(found);
    }
    kept
}

/// Share of the area enclosed by a mask's outline that is not the mask: 0 for a disc, near 1 for a thin ring. Areas
/// at the picture's border are not enclosed.
pub(crate) fn hollowness(mask: &Mask) -> f64 {
    let Some(bounds) = mask.bounds() else { return 0.0 };
    // A flood from outside the box reaches every pixel that is not enclosed.
    let (w, h) = (bounds.x.len() + 2, bounds.y.len() + 2);
    let own = |x: usize, y: usize| {
        let inside = (1..w - 1).contains(&x) && (1..h - 1).contains(&y);
        inside && mask.contains((bounds.y.start + y - 1) * mask.width_px() + bounds.x.start + x - 1)
    };
    let mut wet = vec![false; w * h];
    let mut open = vec![(0_usize, 0_usize)];
    wet[0] = true;
    while let Some((x, y)) = open.pop() {
        let near = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        for (x, y) in near.into_iter().filter(|&(x, y)| x < w && y < h) {
            if !wet[y * w + x] && !own(x, y) {
                wet[y * w + x] = true;
                open.push((x, y));
            }
        }
    }
    let enclosed = wet.iter().filter(|w| !**w).count();
    1.0 - mask.area() as f64 / enclosed as f64
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const W: usize = 60;
    const H: usize = 40;

    fn rectangle(x: std::ops::Range<usize>, y: std::ops::Range<usize>) -> Mask {
        Mask::from_fn(W, H, |i| x.contains(&(i % W)) && y.contains(&(i / W)))
    }

    /// Rectangles with and without holes, no two of one size.
    fn any(random: &mut Pcg64Mcg, n: usize) -> Vec<Mask> {
        let mut masks: Vec<Mask> = Vec::new();
        while masks.len() < n {
            let mut range = |end: usize| {
                let from = random.random_range(0..end - 4);
                from..from + random.random_range(4..=(end - from).min(20))
            };
            let (x, y) = (range(W), range(H));
            let mut mask = rectangle(x.clone(), y.clone());
            if random.random() {
                mask.subtract(&rectangle(x.start + 1..x.end - 1, y.start + 1..y.end - 1));
            }
            if masks.iter().all(|m| m.area() != mask.area()) {
                masks.push(mask);
            }
        }
        masks
    }

    fn disjoint(kept: &[Kept]) -> bool {
        kept.iter().enumerate().all(|(i, a)| kept[..i].iter().all(|b| a.mask.overlap(&b.mask) == 0))
    }

    fn sorted(kept: Vec<Kept>) -> Vec<Vec<usize>> {
        let mut all: Vec<Vec<usize>> = kept.into_iter().map(|k| k.mask.pixels().collect()).collect();
        all.sort();
        all
    }

    #[test]
    fn whatever_the_masks_are() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut seen = [0; 2];
        for round in 0..300 {
            let masks = any(&mut random, 12);
            let object = rectangle(5..45, 5..35);
            let options = FilterOptions { taken: [0.0, 0.3][round % 2], ..FilterOptions::default() };
            let (whole, inner) = (objects(&masks, &options), parts(&object, &masks, &options));
            assert!(disjoint(&whole) && disjoint(&inner));
            assert!(whole.iter().all(|k| !k.mask.is_empty() && k.mask.overlap(&masks[k.index]) == k.mask.area()));
            assert!(inner.iter().all(|k| !k.mask.is_empty() && k.mask.overlap(&object) == k.mask.area()));
            // The largest mask is always an object; any other is an object unless an object is in its way.
            let largest = masks.iter().map(Mask::area).max();
            assert_eq!(whole.first().map(|k| k.mask.area()), largest);
            let free = |i: usize| whole.iter().all(|k| k.index != i && k.mask.overlap(&masks[i]) == 0);
            assert!(!(0..masks.len()).any(free));
            // Control: the masks themselves are neither disjoint nor inside.
            let raw: Vec<Kept> = masks.iter().cloned().enumerate().map(|(index, mask)| Kept { index, mask }).collect();
            seen[0] += usize::from(!disjoint(&raw));
            seen[1] += usize::from(raw.iter().any(|k| k.mask.overlap(&object) < k.mask.area()));
            // The order of the masks does not matter.
            let mut turned = masks.clone();
            turned.reverse();
            turned.rotate_left(round % 12);
            assert_eq!(sorted(objects(&turned, &options)), sorted(whole));
            assert_eq!(sorted(parts(&object, &turned, &options)), sorted(inner));
        }
        assert_eq!(seen, [300; 2]);
    }

    #[test]
    fn large_objects_and_small_parts_go_first() {
        let (cup, handle, logo) = (rectangle(0..20, 0..20), rectangle(14..20, 5..15), rectangle(2..6, 2..6));
        let masks = [logo, handle, cup.clone(), rectangle(18..40, 0..10)];
        let index = |kept: Vec<Kept>| kept.into_iter().map(|k| k.index).collect::<Vec<_>>();
        let paper = FilterOptions::default();
        assert_eq!(index(objects(&masks, &paper)), [2]);
        assert_eq!(index(parts(&cup, &masks, &paper)), [0, 1]);
        // A tenth of the last is taken already.
        let kept = objects(&masks, &FilterOptions { taken: 0.1, ..paper });
        assert_eq!((kept[1].index, kept[1].mask.area()), (3, 20 * 10));
        assert!(objects(&[Mask::empty(W, H)], &paper).is_empty() && objects(&[], &paper).is_empty());
    }

    #[test]
    fn rings_are_hollow_and_arcs_are_not() {
        let mut ring = rectangle(10..30, 10..30);
        ring.subtract(&rectangle(12..28, 12..28));
        assert!((hollowness(&ring) - 256.0 / 400.0).abs() < 1e-12);
        let mut arc = ring.clone();
        arc.subtract(&rectangle(15..17, 28..30));
        assert_eq!((hollowness(&arc), hollowness(&Mask::empty(W, H))), (0.0, 0.0));
        // At the border of the picture nothing is enclosed, not even by a ring that is cut.
        let mut cut = rectangle(0..20, 0..20);
        cut.subtract(&rectangle(0..18, 2..18));
        assert_eq!(hollowness(&cut), 0.0);
        let object = rectangle(5..45, 5..35);
        let paper = FilterOptions::default();
        assert_eq!(parts(&object, &[ring.clone(), arc], &paper).iter().map(|k| k.index).collect::<Vec<_>>(), [1]);
        assert_eq!(parts(&object, &[ring], &FilterOptions { hollow: 0.7, ..paper }).len(), 1);
    }
}
