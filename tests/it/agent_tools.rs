//! The tools' JSON schemas against the calls that the agent reads.

use fmlgs::agent::camera_args::{CLOSENESS, Direction, FARTHEST};
use fmlgs::agent::relation::Relation;
use fmlgs::agent::schema::tools;
use fmlgs::agent::tool::{MAX_TEXT, NAMES, ToolCall};
use fmlgs::navigate::target::Side;
use serde_json::{Value, json};
use strum::VariantArray;

#[test]
fn the_schemas_know_every_word_and_bound_of_the_calls() {
    let tools = tools();
    let of = |tool: &str, path: &str| {
        let at = NAMES.iter().position(|n| *n == tool).expect("a tool");
        tools[at].pointer(&format!("/function/parameters/properties/{path}")).cloned().expect("a property")
    };
    assert_eq!(of("go_to", "side/enum"), json!(Side::VARIANTS));
    assert_eq!(of("move", "direction/enum"), json!(Direction::ALL));
    assert_eq!(of("turn", "direction/enum"), json!(Direction::TURNS));
    assert_eq!(of("list", "relation/enum"), json!(Relation::ALL));
    assert_eq!(of("locate", "query/maxLength"), json!(MAX_TEXT));
    let (least, most) = (CLOSENESS.start(), CLOSENESS.end());
    assert_eq!(of("go_to", "closeness/anyOf/1"), json!({ "type": "number", "minimum": least, "maximum": most }));
    let meters = of("move", "distance/anyOf/0/properties/meters/maximum");
    assert_eq!(meters.as_f64(), Some(FARTHEST));
}

/// Some value that a schema allows, of each of its alternatives.
fn samples(schema: &Value) -> Vec<Value> {
    if let Some(any) = schema["anyOf"].as_array() {
        return any.iter().flat_map(samples).collect();
    }
    if let Some(words) = schema["enum"].as_array() {
        return words.clone();
    }
    match schema["type"].as_str().expect("a type") {
        "string" => vec![json!("lamp")],
        "integer" => vec![json!(1)],
        "number" => vec![json!(1.5)],
        "array" => vec![json!([]), json!([samples(&schema["items"])[0]])],
        "object" => {
            let properties = schema["properties"].as_object().expect("properties");
            let first = |s: &Value| samples(s).first().cloned().expect("a sample");
            let whole: Value =
                properties.iter().map(|(k, s)| (k.clone(), first(s))).collect::<serde_json::Map<_, _>>().into();
            vec![whole]
        }
        other => panic!("type {other}"),
    }
}

#[test]
fn what_a_schema_allows_is_a_call_and_what_it_forbids_is_none() {
    let all = tools();
    let names: Vec<&str> = all.iter().map(|t| t["function"]["name"].as_str().expect("a name")).collect();
    assert_eq!(names, NAMES);
    for tool in &all {
        let (name, schema) = (tool["function"]["name"].as_str().expect("a name"), &tool["function"]["parameters"]);
        let whole = samples(schema)[0].clone();
        assert!(ToolCall::parse(name, &whole.to_string()).is_ok(), "{name} {whole}");
        let required: Vec<&str> =
            schema["required"].as_array().expect("required").iter().filter_map(Value::as_str).collect();
        let mut least = whole.clone();
        least.as_object_mut().expect("an object").retain(|k, _| required.contains(&k.as_str()));
        let call = ToolCall::parse(name, &least.to_string()).expect(name);
        assert_eq!(call.name(), name);
        for (key, property) in schema["properties"].as_object().expect("properties") {
            for sample in samples(property) {
                let mut with = whole.clone();
                with[key] = sample;
                assert!(ToolCall::parse(name, &with.to_string()).is_ok(), "{name} {with}");
            }
            for wrong in [json!({ "no": 1 }), json!(-1), json!([[]]), json!(true)] {
                let mut with = whole.clone();
                with[key] = wrong.clone();
                assert!(ToolCall::parse(name, &with.to_string()).is_err(), "{name} {with}");
            }
            let mut without = whole.clone();
            without.as_object_mut().expect("an object").remove(key);
            let parses = ToolCall::parse(name, &without.to_string()).is_ok();
            assert_eq!(parses, !required.contains(&key.as_str()), "{name} without {key}");
        }
        let mut more = whole.clone();
        more["surprise"] = json!(1);
        assert!(ToolCall::parse(name, &more.to_string()).is_err(), "{name}");
    }
}
