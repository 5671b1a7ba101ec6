//! Invalid input is reported before anything runs; later failures are recorded.

use super::*;

#[test]
fn what_is_wrong_is_told_before_anything_runs() {
    let folder = folder();
    tiny_dataset(folder.path());
    let (jobs, out) = (folder.path().join("jobs.toml"), folder.path().join("runs"));
    let scene = "[[scene]]\npath = \"photos\"\n";
    let setting = |line: &str| format!("{scene}[[setting]]\nname = \"fast\"\n{line}\n");
    let twice = format!("{scene}[[scene]]\npath = \"../{}/photos\"\n", folder.path().file_name().unwrap().display());
    let cases: Vec<(String, Vec<&str>)> = vec![
        ("[[scene]\n".into(), vec!["line 1"]),
        (format!("{scene}\n[eval\n"), vec!["line 4"]),
        (format!("{scene}pathe = \"x\"\n"), vec!["line 3", "pathe", "masks"]),
        (format!("sceen = 1\n{scene}"), vec!["line 1", "sceen"]),
        ("seeds = [1]\n".into(), vec!["[[scene]]", "none"]),
        (format!("seeds = []\n{scene}"), vec!["'seeds'"]),
        (format!("seeds = [3, 4, 3]\n{scene}"), vec!["seeds '3'", "twice"]),
        (format!("seeds = [-1]\n{scene}"), vec!["line 1"]),
        (setting("stepz = 5"), vec!["'fast'", "'stepz'", "steps, max-side"]),
        (setting("steps = \"many\""), vec!["'fast'", "--steps", "from 1 to"]),
        (setting("steps = 0"), vec!["--steps", "from 1 to"]),
        (setting("antialias = 1"), vec!["'antialias'", "true or false"]),
        (setting("seed = 1"), vec!["'seed'", "seeds = "]),
        (setting("steps = [1, 2]"), vec!["'steps'", "one value"]),
        (setting("distortion-weight = 0.5"), vec!["--surfels"]),
        (setting("plan = [\"photos=huge\"]"), vec!["photos"]),
        (setting("preset = \"none.toml\""), vec!["none.toml"]),
        (format!("{scene}[[setting]]\nsteps = 5\n"), vec!["[[setting]] number 1", "name"]),
        (setting("") + "[[setting]]\nname = \"Fast\"\n", vec!["[[setting]] 'Fast'", "twice"]),
        (format!("{scene}[[setting]]\nname = \"a/b\"\n"), vec!["'a/b'", "/"]),
        (format!("{scene}[[setting]]\nname = \"..\"\n"), vec!["'..'", "dot"]),
        (twice, vec!["[[scene]] 'photos'", "twice", "'name'"]),
        ("[[scene]]\npath = \"gone\"\n".into(), vec!["gone", "does not exist"]),
        ("[[scene]]\npath = \"jobs.toml\"\n".into(), vec!["jobs.toml"]),
        (format!("{scene}masks = \"photos\"\n"), vec!["'photos'", "[objects]"]),
        (format!("{scene}[objects]\nencodr = \"none\"\n"), vec!["[objects]", "'encodr'"]),
        (format!("{scene}[objects]\nencoder = \"no-such\"\n"), vec!["[objects]", "'encoder'", "no-such"]),
        (format!("{scene}[objects]\nsegmenter = \"no-such\"\n"), vec!["'segmenter'", "no-such"]),
        (format!("{scene}[eval]\nprotocol = \"guess\"\n"), vec!["[eval]", "guess"]),
        (format!("out = \"photos/runs\"\n{scene}"), vec!["photos", "among what is read", "--out"]),
        (
            "out = \"x\"\n[[scene]]\npath = \"x/a/default/seed-0/in\"\nname = \"a\"\n".into(),
            vec!["folder of its results"],
        ),
    ];
    crate::cli_support::copy(&folder.path().join("photos"), &folder.path().join("x/a/default/seed-0/in"));
    for (file, named) in cases {
        std::fs::write(&jobs, &file).unwrap();
        let mut arguments = vec!["batch", jobs.to_str().unwrap()];
        if !file.contains("out = ") {
            arguments.extend(["--out", out.to_str().unwrap()]);
        }
        let told = fmlgs(&arguments).fails_with(1).stderr;
        assert!(told.contains("jobs.toml"), "{file}\n{told}");
        named.iter().for_each(|word| assert!(told.contains(word), "{word} is not said of\n{file}\n{told}"));
        assert!(!out.exists() && !folder.path().join("photos/runs").exists());
    }
    std::fs::write(&jobs, scene).unwrap();
    for (arguments, code) in [(&["--shard", "0/4"][..], 2), (&["--shard", "5/4"], 2), (&["--takeover-secs", "0"], 2)] {
        done(batch(&jobs, &out, arguments)).fails_with(code);
    }
    // A shard beyond the units has nothing to do; one that has some lists them.
    let two = format!("seeds = [0, 1]\n{scene}");
    std::fs::write(&jobs, two).unwrap();
    let empty = done(batch(&jobs, &out, &["--shard", "9/9", "--json"])).fails_with(2);
    assert!(empty.stderr.contains("nothing in shard 9/9, the batch has 2 units"), "{}", empty.stderr);
    assert!(empty.stdout.is_empty() && !out.exists(), "{}", empty.stdout);
    let listed = done(batch(&jobs, &out, &["--shard", "2/9", "--dry-run", "--json"])).ok().json();
    assert_eq!(listed["units"].as_array().unwrap().len(), 1, "{listed}");
    std::fs::write(&jobs, scene).unwrap();
    // Arrays whose tasks are no range.
    let mut uneven = batch(&jobs, &out, &[]);
    uneven.env("SLURM_ARRAY_TASK_ID", "7").env("SLURM_ARRAY_TASK_COUNT", "2").env("SLURM_ARRAY_TASK_MIN", "3");
    assert!(done(uneven).fails_with(2).stderr.contains("--shard I/N"));
    let mut array = batch(&jobs, &out, &["--dry-run", "--json"]);
    array.env("SLURM_ARRAY_TASK_ID", "14").env("SLURM_ARRAY_TASK_COUNT", "3");
    array.env("SLURM_ARRAY_TASK_MIN", "10").env("SLURM_ARRAY_TASK_STEP", "2");
    assert_eq!(done(array).ok().json()["shard"], "3/3");
}

/// Three units, of which the second cannot be trained.
#[test]
fn a_unit_that_fails_is_recorded_and_stops_no_other() {
    let folder = folder();
    tiny_dataset(folder.path());
    let (jobs, out) = (folder.path().join("jobs.toml"), folder.path().join("runs"));
    let quick = "steps = 3\nmax-side = 16\nno-densify = true\nbackend = \"cpu\"\n";
    let setting = |name: &str, more: &str| format!("[[setting]]\nname = \"{name}\"\n{quick}{more}");
    let file = |more: &str| {
        let settings = [setting("a", ""), setting("b", more), setting("c", "")].concat();
        std::fs::write(&jobs, format!("[[scene]]\npath = \"photos\"\n{settings}")).unwrap();
    };
    // Surfels are not for the GPU.
    file("surfels = true\n");
    let broken =
        std::fs::read_to_string(&jobs).unwrap().replacen("backend = \"cpu\"\nsurfels", "backend = \"gpu\"\nsurfels", 1);
    std::fs::write(&jobs, broken).unwrap();
    let told = done(batch(&jobs, &out, &["--json"])).fails_with(1);
    assert_eq!((&told.json()["done"], &told.json()["failed"][0]["unit"]), (&2.into(), &"photos/b/seed-0".into()));
    assert!(told.stderr.contains("--retry-failed"), "{}", told.stderr);
    let unit = out.join("photos/b/seed-0");
    let failed: Value = serde_json::from_slice(&std::fs::read(unit.join("failed.json")).unwrap()).unwrap();
    assert!(text(&failed["error"]).contains("--backend cpu"), "{failed}");
    // Not tried again until that is asked for, whatever the settings are now.
    file("");
    let before = std::fs::read(out.join("photos/a/seed-0/result.json")).unwrap();
    assert_eq!(done(batch(&jobs, &out, &["--json"])).fails_with(1).json()["failed"].as_array().unwrap().len(), 1);
    assert_eq!(done(batch(&jobs, &out, &["--retry-failed", "--json"])).ok().json()["done"], 3);
    assert!(!unit.join("failed.json").exists() && unit.join("result.json").exists());
    assert_eq!(std::fs::read(out.join("photos/a/seed-0/result.json")).unwrap(), before, "what is done stays");

    // Other settings under the same name: nothing runs, and nothing is lost.
    file("sh-degree = 0\n");
    let refused = done(batch(&jobs, &out, &[])).fails_with(1).stderr;
    assert!(refused.contains("sh_degree: 3 there, 0 now") && refused.contains("photos/b/seed-0"), "{refused}");
    let listed = done(batch(&jobs, &out, &["--dry-run", "--json"])).ok().json();
    let states: Vec<&str> = listed["units"].as_array().unwrap().iter().map(|u| text(&u["state"])).collect();
    assert_eq!(states, ["done", "changed", "done"]);
    // How often a training looks and saves changes nothing, and neither does a comment.
    file("eval-every = 1\ncheckpoint-secs = 5\n# ...\n");
    assert_eq!(done(batch(&jobs, &out, &["--json"])).ok().json()["done"], 3);
    // Other photos under the same name do.
    std::fs::write(
        folder.path().join("photos/images/0003.png"),
        std::fs::read(folder.path().join("photos/images/0001.png")).unwrap(),
    )
    .unwrap();
    assert!(done(batch(&jobs, &out, &[])).fails_with(1).stderr.contains("the photos' names, sizes or cameras"));
}
