//! Tests of undistortion and reduction.

use glam::{DMat3, DVec2, DVec3};

use super::*;
use crate::math::stats;

fn camera(width_px: u32, height_px: u32, focal: f64) -> Camera {
    Camera {
        width_px,
        height_px,
        focal_px: DVec2::new(focal, focal * 1.01),
        principal_px: DVec2::new(f64::from(width_px) * 0.51, f64::from(height_px) * 0.48),
        world_from_camera: DMat3::IDENTITY,
        center: DVec3::ZERO,
    }
}

/// A smooth picture, so that bilinear look-ups are accurate.
fn smooth(u: f64, v: f64) -> [f64; 3] {
    [128.0 + 100.0 * (u / 37.0).sin(), 128.0 + 100.0 * (v / 29.0).cos(), 128.0 + 60.0 * ((u + v) / 53.0).sin()]
}

fn picture(width: usize, height: usize, color: impl Fn(f64, f64) -> [f64; 3]) -> Pixels {
    let mut data = Vec::new();
    for y in 0..height {
        for x in 0..width {
            data.extend(color(x as f64 + 0.5, y as f64 + 0.5).map(|c| c.round() as u8));
        }
    }
    Pixels { width, height, channels: 3, data }
}

/// Finds the pinhole position that the lens maps to `bent`, by Newton's method on numerical derivatives: shares no code
/// with the mapping under test, which goes the other way.
fn straighten(c: &Camera, d: &Distortion, bent: DVec2) -> DVec2 {
    let target = (bent - c.principal_px) / c.focal_px;
    let bend = |q: DVec2| {
        let r2 = q.length_squared();
        let s = 1.0 + d.k1 * r2 + d.k2 * r2 * r2;
        DVec2::new(
            q.x * s + 2.0 * d.p1 * q.x * q.y + d.p2 * (r2 + 2.0 * q.x * q.x),
            q.y * s + d.p1 * (r2 + 2.0 * q.y * q.y) + 2.0 * d.p2 * q.x * q.y,
        )
    };
    let mut q = target;
    for _ in 0..50 {
        let e = bend(q) - target;
        let h = 1e-6;
        let dx = (bend(q + DVec2::X * h) - bend(q - DVec2::X * h)) / (2.0 * h);
        let dy = (bend(q + DVec2::Y * h) - bend(q - DVec2::Y * h)) / (2.0 * h);
        let det = dx.x * dy.y - dy.x * dx.y;
        q -= DVec2::new(dy.y * e.x - dy.x * e.y, dx.x * e.y - dx.y * e.x) / det;
    }
    q * c.focal_px + c.principal_px
}

/// Largest channel error of `out` against the smooth picture over fully covered pixels.
fn worst(out: &PhotoPixels, scale: f64) -> f64 {
    let mut errors = Vec::new();
    let mut seen = 0;
    for (i, rgb) in out.rgb.iter().enumerate() {
        if out.coverage.as_ref().is_some_and(|c| c[i] != 255) {
            continue;
        }
        seen += 1;
        let (x, y) = (i % out.width_px as usize, i / out.width_px as usize);
        let want = smooth((x as f64 + 0.5) * scale, (y as f64 + 0.5) * scale);
        errors.extend(rgb.iter().zip(want).map(|(c, w)| (f64::from(*c) - w).abs()));
    }
    assert!(seen * 10 > out.rgb.len() * 8, "only {seen} pixels are covered");
    stats::worst(errors)
}

#[test]
fn undistortion_inverts_the_lens() {
    let c = camera(240, 180, 200.0);
    let lenses = [
        Distortion { k1: -0.12, k2: 0.03, p1: 0.002, p2: -0.003, ..Distortion::default() },
        Distortion { k1: 0.06, k2: -0.08, p1: -0.001, p2: 0.0002, ..Distortion::default() },
    ];
    for d in lenses {
        // Picture through the lens: the smooth picture at the undistorted position.
        let bent = picture(240, 180, |u, v| {
            let p = straighten(&c, &d, DVec2::new(u, v));
            smooth(p.x, p.y)
        });
        let out = resample(&bent, &c, Some(&d), &c);
        let error = worst(&out, 1.0);
        assert!(error < 1.6, "worst error {error}");
        // Control: the wrong lens is detected.
        let wrong = Distortion { k1: -d.k1, ..d };
        assert!(worst(&resample(&bent, &c, Some(&wrong), &c), 1.0) > 10.0);
        // And reduced by a factor that is no integer, in the same pass.
        let small = c.resized(96, 72);
        let error = worst(&resample(&bent, &c, Some(&d), &small), 2.5);
        assert!(error < 2.5, "worst error {error} at reduced size");
    }
}

#[test]
fn centers_are_what_the_lens_shows_there() {
    let (c, small) = (camera(240, 180, 200.0), camera(96, 72, 80.0));
    let disk = |x: f64, y: f64| (x - 150.0).hypot(y - 60.0) < 45.0;
    let drawn = picture(240, 180, |x, y| [if disk(x, y) { 255.0 } else { 0.0 }; 3]);
    for d in [
        Distortion { k1: 0.2, ..Distortion::default() },
        Distortion { k1: -0.12, k2: 0.03, p1: 0.002, p2: -0.003, ..Distortion::default() },
    ] {
        let lens = resample(&drawn, &c, Some(&d), &small);
        // Counts pixels covered in one picture only; pixels at the border may be either.
        let differ = |d: &Distortion| {
            let shown = |at: usize| disk((at % 240) as f64 + 0.5, (at / 240) as f64 + 0.5);
            let found = centers(&c, d, [96, 72]);
            assert_eq!(found.len(), 96 * 72);
            found.iter().zip(&lens.rgb).filter(|(at, rgb)| at.is_some_and(shown) != (rgb[0] > 127)).count()
        };
        let wrong = differ(&Distortion { k1: -d.k1, ..d });
        // Its center decides here, most of its area there: some of the 110 pixels along the border differ.
        assert!(differ(&d) <= 20 && wrong > 4 * differ(&d), "{} and with a wrong lens {wrong}", differ(&d));
        let beyond = centers(&c, &d, [96, 72])[0].is_none();
        assert_eq!(beyond, lens.coverage.is_some_and(|coverage| coverage[0] == 0));
    }
}

#[test]
fn pixels_that_the_lens_does_not_show_have_no_coverage() {
    let c = camera(240, 180, 200.0);
    let white = picture(240, 180, |_, _| [255.0; 3]);
    // Positive k1 bends outwards: corners of the pinhole picture lie outside the file.
    let d = Distortion { k1: 0.2, ..Distortion::default() };
    let out = resample(&white, &c, Some(&d), &c);
    let coverage = out.coverage.expect("partial");
    assert_eq!((coverage[0], out.rgb[0]), (0, [0; 3]));
    assert_eq!((coverage[90 * 240 + 120], out.rgb[90 * 240 + 120]), (255, [255; 3]));
    // Strong negative k1 folds back: the part beyond the fold must not be a mirror image.
    let d = Distortion { k1: -1.2, ..Distortion::default() };
    let out = resample(&white, &c, Some(&d), &c);
    assert_eq!(out.coverage.expect("partial")[0], 0);
}

#[test]
fn reduction_is_the_exact_mean() {
    let c = camera(4, 4, 4.0);
    let p = Pixels { width: 4, height: 4, channels: 3, data: (0..48).map(|i| (i * 5) as u8).collect() };
    let out = resample(&p, &c, None, &c.resized(2, 2));
    // Pixels 0, 1, 4, 5: channel 0 holds 0, 15, 60, 75.
    assert_eq!(out.rgb[0][0], ((15 + 60 + 75) as f32 / 4.0).round() as u8);
    assert_eq!(out.coverage, None);
    // Three into two: weights 2/3 and 1/3.
    let p = Pixels { width: 3, height: 1, channels: 3, data: vec![30, 30, 30, 90, 90, 90, 150, 150, 150] };
    let out = resample(&p, &camera(3, 1, 3.0), None, &camera(2, 1, 2.0));
    assert_eq!(out.rgb, [[50; 3], [130; 3]]);
}

#[test]
fn same_size_without_distortion_is_the_identity() {
    let p = picture(31, 17, smooth);
    let c = camera(31, 17, 20.0);
    let out = resample(&p, &c, None, &c);
    assert_eq!(out.rgb.as_flattened(), p.data);
    // A lens without distortion takes the other path to the same pixels.
    let out = resample(&p, &c, Some(&Distortion::default()), &c);
    assert_eq!(out.rgb.as_flattened(), p.data);
}

#[test]
fn transparent_pixels_do_not_bleed_their_color() {
    let data = vec![200, 100, 50, 255, 0, 255, 0, 0];
    let p = Pixels { width: 2, height: 1, channels: 4, data };
    let out = resample(&p, &camera(2, 1, 2.0), None, &camera(1, 1, 1.0));
    assert_eq!((out.rgb[0], out.coverage), ([200, 100, 50], Some(vec![128])));
}
