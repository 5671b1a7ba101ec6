//! Knobs: fields of a settings structure by their JSON names, turned one at a time.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Fields of a settings structure with the values that a point had, by their JSON names.
pub type Knobs = BTreeMap<String, Value>;

/// `settings` with some fields as a point has them.
pub(crate) fn turned<T: Serialize + DeserializeOwned>(settings: &T, knobs: &Knobs) -> Result<T, String> {
    let mut fields = serde_json::to_value(settings).map_err(|e| e.to_string())?;
    for (name, value) in knobs {
        *fields.get_mut(name).ok_or_else(|| format!("there is no setting '{name}'"))? = value.clone();
    }
    serde_json::from_value(fields).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::train::TrainConfig;
    use serde_json::json;

    #[test]
    fn fields_are_turned_by_name_and_others_refused() {
        let base = TrainConfig::default();
        let knob = |name: &str, value: Value| turned(&base, &Knobs::from([(name.to_owned(), value)]));
        assert_eq!(knob("steps", json!(12)).expect("a field").steps, 12);
        assert!(knob("nonesuch", json!(1)).is_err_and(|e| e.contains("'nonesuch'")));
        assert!(knob("steps", json!("many")).is_err());
    }
}
