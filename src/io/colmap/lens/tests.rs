//! COLMAP's camera models compared with pycolmap 4.2.1 (`Camera.img_from_cam`).

use super::*;

/// A model, its parameters, and the projections of the rays (0.3, -0.2, 1), (-0.7, 0.5, 1) and (1.1, 0.9, 1), px.
type Reference = (&'static str, &'static [f64], [[f64; 2]; 3]);

const RAYS: [[f64; 2]; 3] = [[0.3, -0.2], [-0.7, 0.5], [1.1, 0.9]];

const REFERENCES: [Reference; 15] = [
    ("SIMPLE_RADIAL", &[400.0, 320.0, 240.0, 0.05], [[440.78, 159.48], [29.64, 447.4], [804.44, 636.36]]),
    (
        "RADIAL",
        &[400.0, 320.0, 240.0, 0.05, -0.02],
        [[440.73944, 159.50704], [32.70656, 445.2096], [768.53248, 606.98112]],
    ),
    (
        "OPENCV",
        &[400.0, 410.0, 321.0, 239.0, 0.05, -0.02, 0.003, -0.002],
        [[441.34744, 156.851416], [31.49056, 451.43904], [768.35648, 618.009248]],
    ),
    (
        "FULL_OPENCV",
        &[400.0, 410.0, 321.0, 239.0, 0.2, -0.05, 0.003, -0.002, 0.01, 0.15, -0.03, 0.006],
        [
            [441.334683088955, 156.8601332225474],
            [31.72176913044666, 451.26976188663724],
            [778.5543439141151, 626.561547509792],
        ],
    ),
    (
        "OPENCV_FISHEYE",
        &[200.0, 205.0, 321.0, 239.0, 0.05, -0.02, 0.003, -0.001],
        [
            [378.91424966039784, 199.42526273206147],
            [203.01842271510446, 325.37936908358427],
            [473.77964794180457, 367.12656838755885],
        ],
    ),
    (
        "SIMPLE_RADIAL_FISHEYE",
        &[200.0, 320.0, 240.0, 0.03],
        [
            [377.79256410333716, 201.47162393110855],
            [202.63353566523529, 323.8331888105462],
            [472.31610347697347, 364.6222664811601],
        ],
    ),
    (
        "RADIAL_FISHEYE",
        &[200.0, 320.0, 240.0, 0.03, -0.01],
        [
            [377.78430648923734, 201.4771290071751],
            [202.9280057493439, 323.62285303618296],
            [471.0692836674436, 363.6021411824538],
        ],
    ),
    (
        "FOV",
        &[200.0, 205.0, 321.0, 239.0, 0.9],
        [
            [382.9769508616152, 196.64908357789625],
            [195.6115225200834, 330.80227815493896],
            [482.901946120111, 374.7768593598204],
        ],
    ),
    (
        "THIN_PRISM_FISHEYE",
        &[200.0, 205.0, 321.0, 239.0, 0.02, -0.01, 0.002, -0.001, 0.004, -0.0007, 0.001, -0.002],
        [
            [378.638359807527, 199.61378746485653],
            [204.13266733772392, 324.56358284202355],
            [471.23359605829535, 364.99135669434315],
        ],
    ),
    (
        "RAD_TAN_THIN_PRISM_FISHEYE",
        &[
            200.0, 205.0, 321.0, 239.0, 0.02, -0.01, 0.004, -0.002, 0.0005, -0.0001, 0.002, -0.001, 0.001, -0.0005,
            0.0008, 0.0002,
        ],
        [
            [378.8752774623173, 199.49588519702715],
            [205.11530047494927, 324.03989791887733],
            [471.7378254803349, 365.0133274378845],
        ],
    ),
    (
        "SIMPLE_DIVISION",
        &[400.0, 320.0, 240.0, -0.1],
        [
            [438.4792879845237, 161.01380801031752],
            [58.124404425860575, 427.053996838671],
            [695.3275204252493, 547.086153075204],
        ],
    ),
    (
        "DIVISION",
        &[400.0, 410.0, 321.0, 239.0, 0.08],
        [
            [442.2746536059613, 156.1289867025931],
            [22.112265876903848, 457.8285196258383],
            [872.8477414826557, 701.7995831979545],
        ],
    ),
    (
        "SIMPLE_FISHEYE",
        &[200.0, 320.0, 240.0],
        [
            [377.5856901402183, 201.60953990652115],
            [204.38399019246793, 322.5828641482372],
            [468.2375865469936, 361.28529808390385],
        ],
    ),
    (
        "FISHEYE",
        &[200.0, 205.0, 321.0, 239.0],
        [
            [378.5856901402183, 199.64977840418416],
            [205.38399019246793, 323.64743575194314],
            [469.2375865469936, 363.31743053600144],
        ],
    ),
    (
        "EUCM",
        &[250.0, 255.0, 321.0, 239.0, 0.6, 1.1],
        [
            [393.0137988677221, 190.030616769949],
            [176.14550924550076, 344.5368432639923],
            [507.1887460723873, 394.38297172222866],
        ],
    ),
];

fn read(name: &str, params: &[f64]) -> Lens {
    let model = by_name(name).expect("known");
    lens(model, (640, 480), params, 1, Path::new("cameras.txt")).expect("sound").expect("a lens")
}

fn focal(lens: &Lens) -> DVec2 {
    let Focal::Px(focal) = lens.focal else { panic!("a focal length in px") };
    focal
}

#[test]
fn every_model_sees_rays_where_pycolmap_sees_them() {
    for (name, params, places) in REFERENCES {
        let lens = read(name, params);
        let principal = lens.principal_px.expect("given");
        for (ray, place) in RAYS.into_iter().zip(places) {
            let found = lens.distortion.bend(ray.into()) * focal(&lens) + principal;
            assert!((found - DVec2::from(place)).length() < 1e-9, "{name}, ray {ray:?}: {found} for {place:?}");
            // And back again.
            let back = lens.distortion.rays().at((DVec2::from(place) - principal) / focal(&lens)).expect("seen");
            let back = back.truncate() / back.z;
            assert!((back - DVec2::from(ray)).length() < 1e-8, "{name}: {ray:?} came back as {back}");
        }
        assert!(lens.distortion.reach() > 1.5, "{name} reaches {}", lens.distortion.reach());
    }
    // Control: another coefficient changes the projection.
    let (name, params, places) = REFERENCES[4];
    let other = Distortion { k1: params[4] + 1e-6, ..read(name, params).distortion };
    let off = other.bend(RAYS[2].into()) * DVec2::new(200.0, 205.0) + DVec2::new(321.0, 239.0);
    assert!((off - DVec2::from(places[2])).length() > 1e-6);
}

#[test]
fn models_have_colmaps_numbers_and_parameters() {
    let path = Path::new("cameras.bin");
    for (number, name, params) in [
        (0, "SIMPLE_PINHOLE", 3),
        (5, "OPENCV_FISHEYE", 8),
        (11, "RAD_TAN_THIN_PRISM_FISHEYE", 16),
        (16, "EUCM", 6),
        (17, PANORAMA, 2),
    ] {
        let model = by_number(number, "camera 1", path).expect(name);
        assert_eq!((model.name, model.params), (name, params));
    }
    assert!(by_number(18, "camera 1", path).is_err_and(|e| e.to_string().contains("number 18 (camera 1)")));
    // Every model with a pinhole has parts, and the others have none.
    for model in &MODELS {
        let params = vec![0.5; model.params];
        assert_eq!(parts(model, &params).is_some(), model.name != PANORAMA, "{}", model.name);
        let one_less = lens(model, (64, 48), &params[1..], 3, path);
        assert!(one_less.is_err_and(|e| e.to_string().contains(model.name)), "{}", model.name);
    }
    let found = lens(&MODELS[17], (64, 32), &[64.0, 32.0], 3, path).expect("sound");
    assert_eq!(found.err().as_deref(), Some(PANORAMA));
}
