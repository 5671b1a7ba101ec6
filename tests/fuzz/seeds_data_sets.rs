//! Seeds of label files and of COLMAP reconstructions.

use std::io::Cursor;

use image::{ImageFormat, Rgba, RgbaImage};
use serde_json::json;

use super::seeds::{Seed, encode, identities};

/// Two segments and a box of YOLO's.
pub const SEGMENTS: &[u8] = b"0 0.1 0.1 0.5 0.1 0.5 0.6 0.1 0.6\n1 0.5 0.5 0.9 0.5 0.7 0.9 0.8\n1 0.5 0.5 0.1 0.1\n";

pub fn labels() -> Vec<Seed> {
    let square = |x: i32| [[x, 1], [x + 6, 1], [x + 6, 9], [x, 9]];
    let polygons = json!({ "info": { "name": "photo.png", "width": 16, "height": 12 }, "objects": [
        { "category": "cup", "segmentation": square(1), "level": "object" },
        { "category": "handle", "segmentation": square(5), "level": "part", "parent": "cup" },
        { "category": "cup", "segmentation": square(8) }] });
    let rle = |counts: serde_json::Value| json!({ "size": [12, 16], "counts": counts });
    let masklets = json!({ "video_frame_count": 8, "masklet": [
        [rle(json!([30, 40, 122])), rle(json!("n0X1j3"))], [rle(json!([192])), rle(json!([0, 192]))]] });
    let gray = RgbaImage::from_fn(16, 12, |x, y| if x + y > 9 { Rgba([255; 4]) } else { Rgba([1, 1, 1, 255]) });
    let deep = image::DynamicImage::from(gray.clone()).into_luma16();
    let luma = image::DynamicImage::from(gray.clone()).into_luma8();
    let png = |picture: &dyn Fn(&mut Cursor<Vec<u8>>)| {
        let mut out = Cursor::new(Vec::new());
        picture(&mut out);
        out.into_inner()
    };
    let groups = json!({ "info": { "description": "ISAT", "name": "photo.png", "folder": "d:\\set", "width": 16, "height": 12 }, "objects": [
        { "category": "ring", "group": 1, "layer": 1.0, "segmentation": square(1) },
        { "category": "ring", "group": "2", "layer": 3, "segmentation": square(8) },
        { "category": "__background__", "group": 0, "layer": 2, "segmentation": [[2, 2], [4, 2], [4, 5]] }] });
    let shape = |kind: &str, points: serde_json::Value| json!({ "label": kind, "shape_type": kind, "points": points, "group_id": 1 });
    let mut mask = shape("mask", json!([[3, 4], [5, 6]]));
    mask["mask"] = json!(base64::encode(png(&|w| luma.write_to(w, ImageFormat::Png).expect("encode"))));
    let shapes = json!({ "version": "5.0", "imagePath": "..\\photo.png", "imageWidth": 16, "imageHeight": 12, "shapes": [
        shape("polygon", json!(square(1))), shape("circle", json!([[5, 5], [7, 5]])), mask,
        shape("rectangle", json!([[1, 1], [9, 4]])), shape("linestrip", json!([[1, 1], [9, 4], [3, 3], [1, 1]])) ] });
    let flat = json!([1, 1, 7, 1, 7, 9, 1.5, 9]);
    let instances = json!({ "images": [{ "id": 1, "file_name": "a/photo.png", "width": 16, "height": 12 }],
        "categories": [{ "id": 1, "name": "cup", "supercategory": "object", "parent": null },
            { "id": 2, "name": "rim \u{b7} cup", "supercategory": "part", "parent": 1 }],
        "annotations": [{ "image_id": 1, "category_id": 1, "segmentation": [flat, flat], "iscrowd": 0 },
            { "image_id": 1, "category_id": 2, "segmentation": rle(json!("n0X1j3")), "iscrowd": 1 },
            { "image_id": 1, "category_id": 2, "bbox": [1, 2, 3, 4] }] });
    vec![
        ("label_polygons", "isat.json", polygons.to_string().into_bytes()),
        ("label_polygons", "groups.json", groups.to_string().into_bytes()),
        ("label_shapes", "labelme.json", shapes.to_string().into_bytes()),
        ("label_instances", "coco.json", instances.to_string().into_bytes()),
        ("label_segments", "yolo.txt", SEGMENTS.to_vec()),
        ("label_names", "table.yaml", b"nc: 2\nnames:\n  0: cup  # of tea\n  1: 'plate'\n".to_vec()),
        ("label_names", "list.yaml", b"names: [cup, \"plate\"]\n".to_vec()),
        ("label_masklets", "sav.json", masklets.to_string().into_bytes()),
        ("label_ids", "identities.json", identities().to_string().into_bytes()),
        ("label_id_map", "grey8.png", png(&|w| luma.write_to(w, ImageFormat::Png).expect("encode"))),
        ("label_id_map", "grey16.png", png(&|w| deep.write_to(w, ImageFormat::Png).expect("encode"))),
        ("label_classes", "classes.txt", b"photo\nwall\n".to_vec()),
        ("label_picture", "grey8.png", png(&|w| luma.write_to(w, ImageFormat::Png).expect("encode"))),
        ("label_picture", "rgba.png", encode(&gray, ImageFormat::Png)),
    ]
}

/// Cameras of models that are no pinhole's; the photos of the folder are of the first two.
const WIDE: &[u8] =
    b"1 OPENCV_FISHEYE 16 12 5 5 8 6 .05 -.02 .003 -.001\n2 EUCM 16 12 8 8 8 6 .6 1.1\n3 FOV 16 12 9 9 8 6 .9\n\
    4 FULL_OPENCV 16 12 9 9 8 6 .2 -.05 .003 -.002 .01 .15 -.03 .006\n5 SIMPLE_DIVISION 16 12 9 8 6 -.1\n\
    6 THIN_PRISM_FISHEYE 16 12 9 9 8 6 .02 -.01 .002 -.001 .004 -.0007 .001 -.002\n7 EQUIRECTANGULAR 16 12 16 12\n\
    8 RAD_TAN_THIN_PRISM_FISHEYE 16 12 9 9 8 6 .02 -.01 .004 -.002 .0005 -.0001 .002 -.001 .001 -.0005 .0008 .0002\n";

pub fn colmap() -> Vec<Seed> {
    let le = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let words = |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let longs = |values: &[u64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let cameras = [
        longs(&[2]),
        words(&[1, 4]),
        longs(&[64, 48]),
        le(&[50.0, 50.0, 32.0, 24.0, 0.1, 0.0, 0.0, 0.01]),
        words(&[2, 0]),
        longs(&[64, 48]),
        le(&[50.0, 32.0, 24.0]),
    ];
    let image = |id: u32| {
        let head = [words(&[id]), le(&[1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]), words(&[1]), b"a.png\0".to_vec()];
        [head.concat(), longs(&[1]), le(&[1.0, 2.0, 0.0])].concat()
    };
    let point =
        |id: u64| [longs(&[id]), le(&[1.0, 2.0, 3.0]), vec![1, 2, 3], le(&[0.5]), longs(&[1]), words(&[1, 0])].concat();
    vec![
        ("colmap_cameras", "two.bin", cameras.concat()),
        ("colmap_images", "two.bin", [longs(&[2]), image(1), image(2)].concat()),
        ("colmap_points", "two.bin", [longs(&[2]), point(9), point(10)].concat()),
        ("colmap_cameras_text", "wide.txt", WIDE.to_vec()),
        (
            "colmap_cameras_text",
            "two.txt",
            b"# x\n1 OPENCV 64 48 50 50 32 24 .1 0 0 .01\n2 SIMPLE_PINHOLE 64 48 50 32 24\n".to_vec(),
        ),
        (
            "colmap_images_text",
            "two.txt",
            b"# x\n1 1 0 0 0 1 2 3 1 a b.png\n1 2 -1\n2 1 0 0 0 1 2 3 1 c.png\n\n".to_vec(),
        ),
        ("colmap_points_text", "two.txt", b"# x\n9 1 2 3 1 2 3 0.5 1 0\n10 1 2 3 1 2 3 0.5\n".to_vec()),
    ]
}
