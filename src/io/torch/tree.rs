//! Values of a checkpoint beside its tensors, found by their path of keys: `0.11`, `step`.

use super::parts::{PickleNode, Value};

/// Tree of values. Lists and tuples have their places as keys.
#[derive(Debug)]
pub(crate) struct TorchTree {
    pub(super) nodes: Vec<PickleNode>,
    pub(super) root: Value,
}

impl Default for TorchTree {
    fn default() -> Self {
        Self { nodes: Vec::new(), root: Value::Nothing }
    }
}

impl TorchTree {
    /// Returns a number or a truth value, one of NumPy included.
    #[allow(dead_code, reason = "results of other methods need it")]
    pub(crate) fn number(&self, path: &str) -> Option<f64> {
        match self.at(&self.root, path)? {
            Value::Int(n) => Some(*n as f64),
            Value::Float(x) => Some(*x),
            Value::Bool(b) => Some(f64::from(u8::from(*b))),
            _ => None,
        }
    }

    /// Returns a text.
    #[allow(dead_code, reason = "results of other methods need it")]
    pub(crate) fn text(&self, path: &str) -> Option<&str> {
        match self.at(&self.root, path)? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Returns the number of values in a tuple, a list or a dictionary; the empty path is the whole file.
    pub(crate) fn length(&self, path: &str) -> Option<usize> {
        match self.node(self.at(&self.root, path)?)? {
            PickleNode::List(items) | PickleNode::Tuple(items) => Some(items.len()),
            PickleNode::Dict(entries) => Some(entries.len()),
            _ => None,
        }
    }

    /// Lists the keys of a dictionary, in order.
    #[allow(dead_code, reason = "results of other methods need it")]
    pub(crate) fn keys(&self, path: &str) -> Vec<String> {
        match self.at(&self.root, path).and_then(|value| self.node(value)) {
            Some(PickleNode::Dict(entries)) => entries.iter().filter_map(|(key, _)| named(key)).collect(),
            _ => Vec::new(),
        }
    }

    fn node(&self, value: &Value) -> Option<&PickleNode> {
        let Value::Node(i) = value else { return None };
        match self.nodes.get(*i)? {
            PickleNode::Module(Some(Value::Node(attributes))) => self.nodes.get(*attributes),
            node => Some(node),
        }
    }

    /// Finds a value. A key may have dots itself; each step takes a part of the path, so that cycles end.
    fn at<'a>(&'a self, value: &'a Value, path: &str) -> Option<&'a Value> {
        if path.is_empty() {
            return Some(value);
        }
        let rest_after = |key: &str| -> Option<Option<usize>> {
            let rest = path.strip_prefix(key).filter(|_| !key.is_empty())?;
            match rest {
                "" => Some(None),
                rest => rest.starts_with('.').then_some(Some(key.len() + 1)),
            }
        };
        let below = |key: &str, value: &'a Value| self.at(value, rest_after(key)?.map_or("", |at| &path[at..]));
        match self.node(value)? {
            PickleNode::List(items) | PickleNode::Tuple(items) => {
                let key = path.split('.').next()?;
                below(key, items.get(key.parse::<usize>().ok()?)?)
            }
            // The last of equal keys counts, as in Python.
            PickleNode::Dict(entries) => entries.iter().rev().find_map(|(key, value)| below(&named(key)?, value)),
            _ => None,
        }
    }
}

fn named(key: &Value) -> Option<String> {
    match key {
        Value::Text(key) => Some(key.to_string()),
        Value::Int(key) => Some(key.to_string()),
        _ => None,
    }
}
