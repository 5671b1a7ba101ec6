//! The shipped scene is the built one, and every thing in it is sound.

use std::collections::{BTreeSet, HashMap};

use super::*;
#[test]
fn the_shipped_scene_is_the_built_one() {
    let built = build().unwrap();
    let remedy = "cargo test --test it write_the_demo_scene -- --ignored";
    assert!(
        built == include_bytes!("../../assets/demo.glb"),
        "assets/demo.glb is out of date; write it anew: {remedy}"
    );
    assert!(built.len() < 2_000_000, "{} bytes", built.len());
}

/// Not a check: writes `assets/demo.glb`.
#[test]
#[ignore = "writes assets/demo.glb anew from the formulas"]
fn write_the_demo_scene() {
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo.glb"), build().unwrap()).unwrap();
}

#[test]
fn things_have_parts_and_controllers_share_their_names() {
    let objects = objects::all();
    assert!(objects.len() >= 10);
    let names: BTreeSet<&str> = objects.iter().map(|o| o.name).collect();
    assert_eq!(names.len(), objects.len(), "object names are unique");
    let parts: HashMap<&str, BTreeSet<&str>> =
        objects.iter().map(|o| (o.name, o.parts.iter().map(|p| p.name).collect())).collect();
    for o in &objects {
        assert!(o.parts.len() >= 2, "{}", o.name);
        assert_eq!(parts[o.name].len(), o.parts.len(), "part names of {} are unique", o.name);
    }
    assert_eq!(parts["red controller"], parts["blue controller"]);
    assert!(parts["red controller"].contains("button a") && parts["red controller"].contains("left stick"));
    let shared = parts.values().filter(|p| p.contains("handle")).count();
    assert!(shared >= 2, "handles on more than one thing");
}

#[test]
fn surfaces_face_outwards() {
    for object in objects::all() {
        for part in &object.parts {
            let mesh = &part.mesh;
            let at = format!("{} of the {}", part.name, object.name);
            assert!(!mesh.triangles.is_empty(), "{at}");
            assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()), "{at}");
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6), "{at}");
            let (mut right, mut wrong) = (0.0, 0.0);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                let area = (b - a).cross(c - a);
                let normal = t.iter().map(|&v| mesh.normals[v as usize]).sum::<glam::DVec3>();
                *(if area.dot(normal) >= 0.0 { &mut right } else { &mut wrong }) += area.length();
            }
            assert!(wrong < 0.002 * right, "{at}: {wrong} of {right} faces against its normals");
        }
    }
}

#[test]
fn things_stand_on_the_table() {
    for object in objects::all().iter().filter(|o| !["floor", "table"].contains(&o.name)) {
        let points = || object.parts.iter().flat_map(|p| &p.mesh.positions);
        let lowest = points().map(|p| p.y).fold(f64::INFINITY, f64::min);
        assert!((-0.004..0.004).contains(&lowest), "{} stands at {lowest}", object.name);
        let reach = points().map(|p| p.x.hypot(p.z)).fold(0.0, f64::max);
        assert!(reach > 0.03 && reach < 0.25, "{} reaches {reach}", object.name);
    }
}

#[test]
fn curves_go_through_their_points() {
    let points = [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]].map(glam::DVec2::from_array);
    let curve = shapes::curve(&points, 4);
    assert_eq!(curve.len(), 9);
    for (i, p) in points.iter().enumerate() {
        assert!(curve[4 * i].distance(*p) < 1e-12);
    }
}

#[test]
fn shapes_have_their_sizes() {
    let sphere = shapes::sphere(0.5, 32);
    assert!(sphere.positions.iter().all(|p| (p.length() - 0.5).abs() < 1e-9));
    let cube = shapes::rounded_box(1.0, 2.0, 3.0, 0.1, 3);
    let largest = cube.positions.iter().fold(glam::DVec3::ZERO, |m, p| m.max(*p));
    assert!(largest.distance(glam::DVec3::new(0.5, 1.0, 1.5)) < 1e-9);
    let ring = shapes::torus(1.0, 0.2, 48, 24);
    let from_core = |p: &glam::DVec3| (p.x.hypot(p.z) - 1.0).hypot(p.y);
    assert!(ring.positions.iter().all(|p| (from_core(p) - 0.2).abs() < 1e-9));
}
