//! Lenses: there and back again, and where they end.

use super::*;

#[test]
fn the_fold_is_where_the_derivative_vanishes() {
    assert!((fold(-1.2, 0.0) - 1.0 / 3.6).abs() < 1e-12);
    assert!(fold(0.3, 0.1).is_infinite());
    assert!(fold(0.0, 0.0).is_infinite());
    for (k1, k2) in [(-0.5, 0.01), (0.3, -0.2), (-0.3, -0.2), (-0.9, 0.3)] {
        let t = fold(k1, k2);
        if t.is_finite() {
            assert!((1.0 + 3.0 * k1 * t + 5.0 * k2 * t * t).abs() < 1e-9, "{k1} {k2} {t}");
        } else {
            assert!(9.0 * k1 * k1 < 20.0 * k2, "{k1} {k2} must have no fold");
        }
    }
}

/// Lenses as people have them, and hostile ones.
fn lenses() -> Vec<Distortion> {
    let none = Distortion::default();
    let fisheye = Distortion { projection: Projection::Fisheye, ..none };
    vec![
        Distortion { k1: -0.3, k2: 0.1, p1: 0.002, p2: -0.003, ..none },
        Distortion { k1: 0.2, more: [0.01, 0.0, 0.0, 0.0], divisor: [0.15, -0.03, 0.006], ..none },
        // Nothing is left beyond the pole of its divisor.
        Distortion { divisor: [-1.5, 0.0, 0.0], ..none },
        fisheye,
        Distortion { k1: -0.05, k2: 0.01, more: [-0.002, 0.0001, 0.0, 0.0], ..fisheye },
        // It folds back on itself before a right angle.
        Distortion { k1: -0.4, ..fisheye },
        Distortion { k1: 0.02, p1: 0.002, p2: -0.001, prism: [0.001, 0.0, -0.002, 0.0], ..fisheye },
        Distortion { k1: 0.02, p1: 0.002, prism: [0.001, 2e-4, -0.002, 1e-4], radial_first: true, ..fisheye },
        Distortion { projection: Projection::Fov(0.9), ..none },
        Distortion { projection: Projection::Fov(0.0), ..none },
        Distortion { projection: Projection::Division(-0.3), ..none },
        Distortion { projection: Projection::Division(0.2), ..none },
        Distortion { projection: Projection::Unified(0.6, 1.1), ..none },
    ]
}

#[test]
fn what_is_seen_leads_back_to_its_ray() {
    for lens in lenses() {
        let (rays, reach) = (lens.rays(), lens.reach().min(4.0));
        let mut seen = 0;
        for i in 0..400 {
            let (angle, r) = (0.7 * f64::from(i), reach * (f64::from(i) + 0.5) / 402.0);
            let q = DVec2::from_angle(angle) * r;
            let Some(ray) = rays.at(lens.bend(q)) else { continue };
            seen += 1;
            assert!((ray.length() - 1.0).abs() < 1e-12);
            assert!((ray.truncate() / ray.z - q).length() < 1e-5 * (1.0 + r * r), "{lens:?}: {q} is {ray}");
        }
        // The radial part decides how far it reaches; what bends to the side folds a little before or after.
        assert!(seen >= 390, "{lens:?}: {seen}");
    }
}

#[test]
fn beyond_the_fold_nothing_is_seen() {
    let lens = Distortion { k1: -0.4, projection: Projection::Fisheye, ..Distortion::default() };
    // θ - 0.4 θ³ grows to θ² = 1 / 1.2.
    let fold = (1.0_f64 / 1.2).sqrt();
    assert!((lens.reach() - fold.tan()).abs() < 1e-6, "{}", lens.reach());
    let rays = lens.rays();
    assert!((rays.most_angle - fold).abs() < 1e-6);
    let edge = fold - 0.4 * fold.powi(3);
    assert!(rays.at(DVec2::new(edge + 1e-3, 0.0)).is_none());
    assert!(rays.at(DVec2::new(edge - 1e-3, 0.0)).is_some());
    assert!(rays.at(DVec2::NAN).is_none());
}

#[test]
fn a_fisheye_sees_behind_itself_and_a_pinhole_does_not() {
    let fisheye = Distortion { projection: Projection::Fisheye, ..Distortion::default() };
    let ray = fisheye.rays().at(DVec2::new(0.0, 2.0)).expect("seen");
    assert!((ray - DVec3::new(0.0, 2.0_f64.sin(), 2.0_f64.cos())).length() < 1e-12, "{ray}");
    assert!((fisheye.reach() - WIDEST.tan()).abs() < 1e-12);
    let pinhole = Distortion::default().rays().at(DVec2::new(0.0, 2.0)).expect("seen");
    assert!((pinhole.truncate() / pinhole.z - DVec2::new(0.0, 2.0)).length() < 1e-9);
}

#[test]
fn hostile_coefficients_end_and_give_nothing_that_is_not_finite() {
    for v in [f64::MAX, -f64::MAX, f64::NAN, f64::INFINITY, 1e300, -1e-300] {
        for mut lens in lenses() {
            lens.k2 = v;
            lens.divisor[1] = v;
            lens.prism[2] = v;
            let rays = lens.rays();
            for place in [DVec2::ZERO, DVec2::new(0.3, -2.0), DVec2::splat(1e200)] {
                assert!(rays.at(place).is_none_or(|ray| ray.is_finite()), "{lens:?}");
            }
            assert!(!lens.reach().is_nan() || v.is_nan());
        }
    }
}

#[test]
fn coefficients_have_names() {
    let lens =
        Distortion { k1: 1.0, more: [0.0, 4.0, 0.0, 0.0], projection: Projection::Fov(0.9), ..Distortion::default() };
    assert_eq!(lens.coefficients(), [("omega".into(), 0.9), ("k1".into(), 1.0), ("k4".into(), 4.0)]);
    assert!(Distortion { k1: 1.0, p2: 0.5, ..Distortion::default() }.is_plain() && !lens.is_plain());
}
