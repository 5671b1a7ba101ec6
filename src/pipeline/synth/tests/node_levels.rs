//! Objects and parts of node trees.

use super::*;

/// Names of objects and, in brackets, of their parts.
fn named(scene: &MeshScene, levels: Levels) -> Vec<(String, Vec<String>)> {
    let list = levels::identities(scene, levels, "file").unwrap().list;
    assert!(list.iter().enumerate().all(|(i, identity)| usize::from(identity.id) == i + 1));
    let parts = |id| list.iter().filter(|p| p.parent == Some(id)).map(|p| p.name.clone()).collect();
    list.iter().filter(|i| i.level == Level::Object).map(|i| (i.name.clone(), parts(i.id))).collect()
}

fn expect(found: &[(String, Vec<String>)], expected: &[(&str, &[&str])]) {
    let expected: Vec<(String, Vec<String>)> =
        expected.iter().map(|(o, p)| ((*o).to_owned(), p.iter().map(|p| (*p).to_owned()).collect())).collect();
    assert_eq!(found, expected);
}

#[test]
fn levels_of_node_trees() {
    let tree = |nodes: Value, roots: Value| {
        let (root, bin) = cubes(nodes, roots, json!([]));
        gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap()
    };
    // Wrappers are skipped, a group without a name hands its meshes up, a lone mesh is a whole object.
    let scene = tree(
        json!([
            { "name": "Scene", "children": [1] },
            { "name": "RootNode", "children": [2, 6, 8] },
            { "name": "mug", "children": [3, 4] },
            { "name": "body", "mesh": 0 },
            { "name": "handle", "children": [5] },
            { "mesh": 0 },
            { "name": "ball", "children": [7] },
            { "name": "Object_1", "mesh": 0 },
            { "name": "empty" },
        ]),
        json!([0]),
    );
    expect(&named(&scene, Levels::Nodes), &[("mug", &["body", "handle"]), ("ball", &[])]);
    expect(&named(&scene, Levels::File), &[("file", &["body", "handle", "Object_1"])]);
    // A lone group of plain meshes is an object; parts may lie below parts; own meshes are no part.
    let scene = tree(
        json!([
            { "name": "bike", "children": [1, 2] },
            { "name": "wheel", "mesh": 0 },
            { "name": "frame", "mesh": 0, "children": [3] },
            { "name": "fork", "mesh": 0 },
        ]),
        json!([0]),
    );
    expect(&named(&scene, Levels::Nodes), &[("bike", &["wheel", "frame", "fork"])]);
    let scene = tree(json!([{ "mesh": 0, "children": [1] }, { "name": "lid", "mesh": 0 }]), json!([0]));
    expect(&named(&scene, Levels::Nodes), &[("node 0", &["lid"])]);
    let ids = levels::identities(&scene, Levels::Nodes, "t").unwrap().of_node;
    assert_eq!((ids[0].object, ids[0].part, ids[1].object, ids[1].part), (1, 0, 1, 2));
}

#[test]
fn levels_of_real_scenes() {
    let Some(folder) = real_scenes() else { return };
    let of = |file: &str| named(&gltf_mesh::read(&folder.join(file)).unwrap(), Levels::Nodes);
    expect(&of("CesiumMilkTruck/CesiumMilkTruck.glb"), &[("Cesium_Milk_Truck", &["Wheels", "Wheels.001"])]);
    expect(
        &of("kenney_vehicles/vehicle-motorcycle.glb"),
        &[("motorcycle", &["wheel-back", "wheel-front", "body", "fork"])],
    );
    expect(&of("ToyCar/ToyCar.gltf"), &[("ToyCar", &[]), ("Fabric", &[]), ("Glass", &[])]);
    assert_eq!(of("sunglasses/sunglasses.glb").len(), 8);
    assert_eq!(of("kenney_vehicles/vehicle-truck-red.glb").len(), 6);
    let truck = gltf_mesh::read(&folder.join("kenney_vehicles/vehicle-truck-red.glb")).unwrap();
    assert_eq!(named(&truck, Levels::File)[0].1.len(), 6);
}
