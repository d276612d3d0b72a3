//! Settings, machines and headers as flat lists of keys and values.

use std::collections::BTreeMap;

use serde_json::Value;

/// Keys such as `machine.motor.0.max_speed`, each with its value as text.
pub type Facts = BTreeMap<String, String>;

/// A key whose value differs; `None` where a side has no such key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// The key.
    pub key: String,
    /// Its old value.
    pub old: Option<String>,
    /// Its new value.
    pub new: Option<String>,
}

/// Adds all values of a document below a key.
pub(super) fn flatten(key: &str, value: &Value, facts: &mut Facts) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        Value::Object(map) => map.iter().for_each(|(name, value)| flatten(&below(name), value, facts)),
        // Lists of numbers or names are one value; lists of tables are not.
        Value::Array(items) if items.iter().any(Value::is_object) => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, value)| flatten(&below(&index.to_string()), value, facts));
        }
        Value::Null => {}
        Value::String(text) => {
            facts.insert(key.to_owned(), text.clone());
        }
        other => {
            facts.insert(key.to_owned(), other.to_string());
        }
    }
}

/// The keys that differ, in their order.
pub(super) fn changed(old: &Facts, new: &Facts) -> Vec<Changed> {
    let keys: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let of =
        |key: &String| Changed { key: key.clone(), old: old.get(key).cloned(), new: new.get(key).cloned() };
    keys.into_iter().map(of).filter(|changed| changed.old != changed.new).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn changed_keys_of_nested_tables() {
        let mut facts = [Facts::new(), Facts::new()];
        let old = json!({"motor": [{"name": "a", "max_speed": "60deg/s"}, {"name": "b"}], "size": [1, 2], "gone": true});
        let new = json!({"motor": [{"name": "a", "max_speed": "90deg/s"}, {"name": "b"}], "size": [1, 3], "none": null});
        flatten("machine", &old, &mut facts[0]);
        flatten("machine", &new, &mut facts[1]);
        let texts: Vec<String> = changed(&facts[0], &facts[1])
            .iter()
            .map(|c| format!("{} {:?} {:?}", c.key, c.old, c.new))
            .collect();
        assert_eq!(
            texts,
            [
                "machine.gone Some(\"true\") None",
                "machine.motor.0.max_speed Some(\"60deg/s\") Some(\"90deg/s\")",
                "machine.size Some(\"[1,2]\") Some(\"[1,3]\")"
            ]
        );
    }
}
