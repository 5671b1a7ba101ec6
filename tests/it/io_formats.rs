//! Splat formats against small files that other programs wrote (see `tests/data/formats/README.md`), and through the
//! real binary.

use std::path::{Path, PathBuf};

use crate::cli_support::{fmlgs, folder};
use fmlgs::io::{self, Opened};
use fmlgs::scene::{Axes, GaussianCloud, SplatRenderMode};
use glam::DVec3;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats").join(name)
}

fn cloud(path: &Path) -> GaussianCloud {
    cloud_in(path, None)
}

fn cloud_in(path: &Path, axes: Option<Axes>) -> GaussianCloud {
    match io::open_in(path, axes) {
        Ok(Opened::Cloud(c)) => c,
        other => panic!("{}: {other:?}", path.display()),
    }
}

/// The largest errors of position, log-scale, rotation, opacity and color where each Gaussian is compared with the
/// nearest one of `b`, turned by `turn`: writers change their order.
fn errors(a: &GaussianCloud, b: &GaussianCloud, turn: DVec3) -> [f64; 5] {
    let place = |c: &GaussianCloud, i: usize| c.world_position(i);
    let opacity = |l: f32| 1.0 / (1.0 + f64::from(-l).exp());
    let mut most = [0.0_f64; 5];
    assert_eq!(a.len(), b.len());
    for i in 0..a.len() {
        let at = |j: &usize| (place(a, i) * turn).distance(place(b, *j));
        let j = (0..b.len()).min_by(|x, y| at(x).total_cmp(&at(y))).unwrap();
        let unit = |q: [f32; 4]| fmlgs::math::rotation::unit_quaternion(q).unwrap();
        let (p, q) = (unit(a.quaternions[i]), unit(b.quaternions[j]));
        let dot: f32 = p.iter().zip(q).map(|(p, q)| p * q).sum();
        let far = |x: [f32; 3], y: [f32; 3]| x.iter().zip(y).map(|(x, y)| f64::from((x - y).abs())).fold(0.0, f64::max);
        let found = [
            at(&j),
            far(a.log_scales[i], b.log_scales[j]),
            if turn == DVec3::ONE { f64::from(1.0 - dot.abs()) } else { 0.0 },
            (opacity(a.opacity_logits[i]) - opacity(b.opacity_logits[j])).abs(),
            far(a.sh[i * a.sh_stride()], b.sh[j * b.sh_stride()]),
        ];
        most.iter_mut().zip(found).for_each(|(m, f)| *m = m.max(f));
    }
    most
}

#[test]
fn what_other_programs_wrote_is_what_they_were_given() {
    let few = cloud(&data("few.ply"));
    assert_eq!((few.len(), few.sh_degree, few.render_mode), (48, 2, SplatRenderMode::Mip));
    let bytes = [3e-3, 3e-3, 1e-4, 5e-3, 0.02];
    for (name, degree, mode, most) in [
        ("few.compressed.ply", 2, SplatRenderMode::Mip, bytes),
        ("few.sog", 2, SplatRenderMode::Mip, [3e-4, 0.02, 1e-4, 5e-3, 0.02]),
        ("few_v3.spz", 2, SplatRenderMode::Mip, [3e-4, 0.04, 1e-4, 5e-3, 0.02]),
        ("few_v4.spz", 2, SplatRenderMode::Mip, [3e-4, 0.04, 1e-4, 5e-3, 0.02]),
        ("few.splat", 0, SplatRenderMode::Plain, [1e-6, 1e-5, 1e-3, 5e-3, 0.02]),
        ("few_0.ksplat", 2, SplatRenderMode::Plain, [1e-6, 1e-5, 1e-3, 5e-3, 0.02]),
        ("few_1.ksplat", 2, SplatRenderMode::Plain, [1e-3, 1e-3, 1e-3, 5e-3, 0.02]),
        ("few_2.ksplat", 2, SplatRenderMode::Plain, [1e-3, 1e-3, 1e-3, 5e-3, 0.02]),
    ] {
        // This writer keeps the axes of the .ply in SPZ, and does not say so.
        let c = cloud_in(&data(name), name.ends_with(".spz").then_some(Axes::PLY));
        assert_eq!((c.sh_degree, c.render_mode), (degree, mode), "{name}");
        let found = errors(&few, &c, DVec3::ONE);
        assert!(found.iter().zip(most).all(|(f, most)| *f <= most), "{name}: {found:?}");
    }
    // Its writer turns glTF half around, as the format asks for.
    let glb = errors(&few, &cloud(&data("few.glb")), DVec3::ONE);
    assert!(glb.iter().zip([1e-6, 1e-5, 1e-6, 1e-5, 1e-6]).all(|(f, most)| *f <= most), "{glb:?}");
    // Without being told, an SPZ is read as documented, and that is said.
    let spz = cloud(&data("few_v4.spz"));
    assert!(errors(&few, &spz, DVec3::new(1.0, -1.0, -1.0))[0] < 3e-4 && spz.warnings[0].contains("axes"));
    // Control: another cloud's Gaussians are not near.
    let other = cloud(&data("few.splat"));
    assert!(errors(&few, &GaussianCloud { positions: few.log_scales.clone(), ..other }, DVec3::ONE)[0] > 0.1);
}

#[test]
fn the_command_line_writes_every_format_and_tells_what_it_lost() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let few = data("few.ply");
    let few = few.to_str().unwrap();
    for (name, least_db, rounds) in [
        ("a.ply", f64::INFINITY, false),
        ("a.glb", 90.0, false),
        ("a.gltf", 90.0, false),
        ("a.compressed.ply", 30.0, true),
        ("a.spz", 30.0, true),
        ("a.sog", 20.0, true),
        ("sog/meta.json", 20.0, true),
        ("a.splat", 10.0, true),
    ] {
        let done = fmlgs(&["export", few, "--out", &at(name), "--json", "-q"]).ok().json();
        assert_eq!((&done["gaussians"], done["rounded"].is_string()), (&48.into(), rounds), "{done}");
        let db = done["drawn"]["psnr"].as_f64().unwrap_or(f64::INFINITY);
        assert!(db >= least_db && done["drawn"]["views"] == 4, "{name}: {done}");
        let info = fmlgs(&["info", &at(name), "--json"]).ok().json();
        assert_eq!((&info["kind"], &info["gaussians"]), (&"splat".into(), &48.into()), "{info}");
    }
    assert_eq!(cloud(Path::new(&at("a.ply"))), cloud(Path::new(few)));
    let told = fmlgs(&["export", few, "--out", &at("b.splat"), "--no-measure", "-q"]).ok().stdout;
    assert!(told.contains("not stored: view-dependent color") && told.contains("Mip-Splatting"), "{told}");
    assert!(!told.contains("PSNR"), "{told}");
    // A SOG is not written over a SOG, nothing over what is read, and endings are known.
    fmlgs(&["export", few, "--out", &at("sog/meta.json"), "-q"]).fails_with(1);
    let own = fmlgs(&["export", &at("a.spz"), "--out", &at("a.spz")]);
    assert!(own.stderr.contains("is read by this command"), "{}", own.stderr);
    own.fails_with(2);
    let unknown = fmlgs(&["export", few, "--out", &at("a.ksplat")]);
    assert!(unknown.stderr.contains(".compressed.ply, .spz"), "{}", unknown.stderr);
    unknown.fails_with(2);
}
