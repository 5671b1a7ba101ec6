//! Reader of the pickles in PyTorch files: the few opcodes and names that tensors need. Nothing is ever executed; an
//! unlisted name is an error that contains it.

use std::collections::HashMap;
use std::sync::Arc;

use super::WeightFileError;
use super::numpy;
use super::parts::{Global, PickleNode, Storage, TensorRecord, Value};
use super::tree::TorchTree;

/// Most objects of a pickle; official files have some thousands.
const MOST_OBJECTS: usize = 1 << 20;
/// Most axes of a tensor.
const MOST_AXES: usize = 8;

type Result<T> = std::result::Result<T, WeightFileError>;

/// Reads a pickle.
pub(super) fn read(bytes: &[u8]) -> Result<TorchTree> {
    let mut machine =
        Machine { bytes, at: 0, stack: Vec::new(), marks: Vec::new(), memo: HashMap::new(), nodes: Vec::new() };
    let root = machine.run()?;
    Ok(TorchTree { nodes: machine.nodes, root })
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Value>,
    /// Heights of the stack.
    marks: Vec<usize>,
    memo: HashMap<u32, Value>,
    nodes: Vec<PickleNode>,
}

impl Machine<'_> {
    fn run(&mut self) -> Result<Value> {
        loop {
            let begin = self.at;
            let [opcode] = self.take()?;
            match opcode {
                0x80 => drop(self.take::<1>()?),
                0x95 => drop(self.take::<8>()?),
                b'.' => return self.pop(),
                b'(' => self.marks.push(self.stack.len()),
                b'N' => self.push(Value::Nothing)?,
                0x88 | 0x89 => self.push(Value::Bool(opcode == 0x88))?,
                b'J' => self.integer::<4>()?,
                b'K' => self.integer::<1>()?,
                b'M' => self.integer::<2>()?,
                0x8a => match self.take()? {
                    [8] => self.integer::<8>()?,
                    [n] => self.long(usize::from(n))?,
                },
                b'G' => {
                    let value = f64::from_be_bytes(self.take()?);
                    self.push(Value::Float(value))?;
                }
                b'C' => {
                    let [length] = self.take()?;
                    let bytes = Arc::from(self.slice(usize::from(length))?);
                    self.push(Value::Bytes(bytes))?;
                }
                b'B' => {
                    let length = u32::from_le_bytes(self.take()?);
                    let bytes = Arc::from(self.slice(length as usize)?);
                    self.push(Value::Bytes(bytes))?;
                }
                b'X' | b'T' => {
                    let length = u32::from_le_bytes(self.take()?);
                    self.text(length as usize)?;
                }
                0x8c | b'U' => {
                    let [length] = self.take()?;
                    self.text(usize::from(length))?;
                }
                b')' => self.node(PickleNode::Tuple(Vec::new()))?,
                0x85..=0x87 => {
                    let mut items = (0x84..opcode).map(|_| self.pop()).collect::<Result<Vec<_>>>()?;
                    items.reverse();
                    self.node(PickleNode::Tuple(items))?;
                }
                b't' => {
                    let items = self.marked()?;
                    self.node(PickleNode::Tuple(items))?;
                }
                b']' => self.node(PickleNode::List(Vec::new()))?,
                b'a' => {
                    let item = self.pop()?;
                    self.extend(vec![item])?;
                }
                b'e' => {
                    let items = self.marked()?;
                    self.extend(items)?;
                }
                b'}' => self.node(PickleNode::Dict(Vec::new()))?,
                b's' => {
                    let value = self.pop()?;
                    let key = self.pop()?;
                    self.set(vec![key, value])?;
                }
                b'u' => {
                    let items = self.marked()?;
                    self.set(items)?;
                }
                b'q' => {
                    let [key] = self.take()?;
                    self.remember(u32::from(key))?;
                }
                b'r' => {
                    let key = u32::from_le_bytes(self.take()?);
                    self.remember(key)?;
                }
                0x94 => self.remember(self.memo.len() as u32)?,
                b'h' => {
                    let [key] = self.take()?;
                    self.recall(u32::from(key))?;
                }
                b'j' => {
                    let key = u32::from_le_bytes(self.take()?);
                    self.recall(key)?;
                }
                b'c' => {
                    let (module, name) = (self.line()?, self.line()?);
                    self.global(&module, &name)?;
                }
                0x93 => match (self.pop()?, self.pop()?) {
                    (Value::Text(name), Value::Text(module)) => self.global(&module, &name)?,
                    _ => return Err(self.malformed("a name that is no text")),
                },
                b'Q' => self.storage()?,
                b'R' => self.call()?,
                0x81 => {
                    let (_arguments, class) = (self.pop()?, self.pop()?);
                    match self.of(&class) {
                        Some(PickleNode::Global(Global::Module)) => self.node(PickleNode::Module(None))?,
                        _ => return Err(self.malformed("an object that is no module")),
                    }
                }
                b'b' => self.build()?,
                opcode => return Err(WeightFileError::Opcode { opcode, at: begin }),
            }
        }
    }

    fn malformed(&self, what: &str) -> WeightFileError {
        WeightFileError::Pickle { what: what.into(), at: self.at }
    }

    fn slice(&mut self, length: usize) -> Result<&[u8]> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| WeightFileError::Pickle { what: "its end".into(), at: self.bytes.len() })?;
        let begin = std::mem::replace(&mut self.at, end);
        Ok(&self.bytes[begin..end])
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut taken = [0; N];
        taken.copy_from_slice(self.slice(N)?);
        Ok(taken)
    }

    /// Reads an integer of `N` bytes; those of 4 and 8 have a sign.
    fn integer<const N: usize>(&mut self) -> Result<()> {
        let mut bytes = [0; 8];
        bytes[..N].copy_from_slice(&self.take::<N>()?);
        let value = i64::from_le_bytes(bytes);
        self.push(Value::Int(if N == 4 { i64::from(value as i32) } else { value }))
    }

    /// An integer of fewer than 8 bytes, with a sign.
    fn long(&mut self, length: usize) -> Result<()> {
        let bytes = self.slice(length)?;
        if length > 8 {
            return Err(self.malformed("an integer of more than 64 bits"));
        }
        let negative = bytes.last().is_some_and(|b| b & 0x80 != 0);
        let mut whole = [if negative { 0xff } else { 0 }; 8];
        whole[..length].copy_from_slice(bytes);
        self.push(Value::Int(i64::from_le_bytes(whole)))
    }

    fn text(&mut self, length: usize) -> Result<()> {
        let text = std::str::from_utf8(self.slice(length)?).map(Arc::from);
        let text = text.map_err(|_| self.malformed("a text that is not UTF-8"))?;
        self.push(Value::Text(text))
    }

    fn line(&mut self) -> Result<String> {
        let length = self.bytes[self.at..].iter().position(|b| *b == b'\n');
        let length = length.ok_or_else(|| self.malformed("a name without end"))?;
        let line = String::from_utf8_lossy(self.slice(length + 1)?);
        Ok(line.trim_end().to_owned())
    }

    fn push(&mut self, value: Value) -> Result<()> {
        if self.stack.len() >= MOST_OBJECTS {
            return Err(WeightFileError::TooMany { what: "objects", most: MOST_OBJECTS });
        }
        self.stack.push(value);
        Ok(())
    }

    fn node(&mut self, node: PickleNode) -> Result<()> {
        if self.nodes.len() >= MOST_OBJECTS {
            return Err(WeightFileError::TooMany { what: "objects", most: MOST_OBJECTS });
        }
        self.nodes.push(node);
        self.push(Value::Node(self.nodes.len() - 1))
    }

    fn of(&self, value: &Value) -> Option<&PickleNode> {
        match value {
            Value::Node(i) => self.nodes.get(*i),
            _ => None,
        }
    }

    fn pop(&mut self) -> Result<Value> {
        let floor = self.marks.last().copied().unwrap_or(0);
        let value = if self.stack.len() > floor { self.stack.pop() } else { None };
        value.ok_or_else(|| self.malformed("a value that is not there"))
    }

    /// Returns the node on top of the stack, which stays.
    fn top(&mut self) -> Result<&mut PickleNode> {
        let top = self.stack.last().cloned();
        match top {
            Some(Value::Node(i)) if i < self.nodes.len() => Ok(&mut self.nodes[i]),
            _ => Err(self.malformed("no list, dictionary or module")),
        }
    }

    fn marked(&mut self) -> Result<Vec<Value>> {
        let mark = self.marks.pop().ok_or_else(|| self.malformed("a mark that is not there"))?;
        Ok(self.stack.split_off(mark.min(self.stack.len())))
    }

    fn extend(&mut self, items: Vec<Value>) -> Result<()> {
        match self.top()? {
            PickleNode::List(list) => list.extend(items),
            _ => return Err(self.malformed("an item of no list")),
        }
        Ok(())
    }

    fn set(&mut self, items: Vec<Value>) -> Result<()> {
        let odd = items.len() % 2 == 1;
        match self.top()? {
            PickleNode::Dict(dict) if !odd => {
                let mut items = items.into_iter();
                while let (Some(key), Some(value)) = (items.next(), items.next()) {
                    dict.push((key, value));
                }
            }
            _ => return Err(self.malformed("an entry of no dictionary")),
        }
        Ok(())
    }

    fn remember(&mut self, key: u32) -> Result<()> {
        let top = self.stack.last().cloned().ok_or_else(|| self.malformed("a value that is not there"))?;
        if self.memo.len() >= MOST_OBJECTS {
            return Err(WeightFileError::TooMany { what: "objects", most: MOST_OBJECTS });
        }
        self.memo.insert(key, top);
        Ok(())
    }

    fn recall(&mut self, key: u32) -> Result<()> {
        let value = self.memo.get(&key).cloned().ok_or_else(|| self.malformed("a value that was not kept"))?;
        self.push(value)
    }

    fn global(&mut self, module: &str, name: &str) -> Result<()> {
        let global = Global::named(module, name);
        let global = global.ok_or_else(|| WeightFileError::Global { name: format!("{module}.{name}") })?;
        self.node(PickleNode::Global(global))
    }

    fn items(&self, value: &Value) -> &[Value] {
        match self.of(value) {
            Some(PickleNode::Tuple(items) | PickleNode::List(items)) => items,
            _ => &[],
        }
    }

    /// Pops `("storage", type, key, device, elements)` and pushes the storage.
    fn storage(&mut self) -> Result<()> {
        let id = self.pop()?;
        let storage = match self.items(&id) {
            [Value::Text(kind), class, Value::Text(key), _device, Value::Int(elements)] if &**kind == "storage" => {
                match (self.of(class), usize::try_from(*elements)) {
                    (Some(PickleNode::Global(Global::Storage(dtype))), Ok(elements)) => {
                        Some(Storage { key: key.clone(), dtype: *dtype, elements })
                    }
                    _ => None,
                }
            }
            _ => None,
        };
        self.node(PickleNode::Storage(storage.ok_or_else(|| self.malformed("a storage without type, name or size"))?))
    }

    fn call(&mut self) -> Result<()> {
        let (arguments, function) = (self.pop()?, self.pop()?);
        let Some(PickleNode::Global(function)) = self.of(&function) else {
            return Err(self.malformed("a call of no function"));
        };
        match function {
            Global::OrderedDict if self.items(&arguments).is_empty() => self.node(PickleNode::Dict(Vec::new())),
            Global::First => {
                let first = self.items(&arguments).first().cloned();
                let first = first.ok_or_else(|| self.malformed("a call without argument"))?;
                self.push(first)
            }
            Global::Tensor => {
                let tensor = self.tensor(&arguments);
                self.node(PickleNode::Tensor(
                    tensor.ok_or_else(|| self.malformed("a tensor without storage or shape"))?,
                ))
            }
            Global::Latin1 => match self.items(&arguments) {
                [Value::Text(text), Value::Text(code)] if &**code == "latin1" => {
                    let text = text.clone();
                    self.push(Value::Text(text))
                }
                _ => Err(self.malformed("bytes in a code other than Latin-1")),
            },
            Global::Setting => self.push(Value::Nothing),
            Global::NumpyArray => self.node(PickleNode::NumpyArray),
            Global::NumpyDtype => match self.items(&arguments).first() {
                Some(Value::Text(code)) => {
                    let code = code.clone();
                    self.node(PickleNode::NumpyDtype(code))
                }
                _ => Err(self.malformed("a type of NumPy without name")),
            },
            Global::NumpyScalar => {
                let number = match self.items(&arguments) {
                    [dtype, bytes] => match self.of(dtype) {
                        Some(PickleNode::NumpyDtype(code)) => numpy::number(code, bytes),
                        _ => None,
                    },
                    _ => None,
                };
                self.push(number.ok_or_else(|| self.malformed("a number of NumPy without type or of another size"))?)
            }
            _ => Err(self.malformed("a call of what is no function")),
        }
    }

    /// Parses a tensor: `(storage, offset, shape, strides, ...)`.
    fn tensor(&self, arguments: &Value) -> Option<TensorRecord> {
        let [storage, Value::Int(offset), shape, strides, ..] = self.items(arguments) else { return None };
        let Some(PickleNode::Storage(storage)) = self.of(storage) else { return None };
        let lengths = |value: &Value| -> Option<Vec<usize>> {
            if self.items(value).len() > MOST_AXES {
                return None;
            }
            let length = |v: &Value| if let Value::Int(i) = v { usize::try_from(*i).ok() } else { None };
            self.items(value).iter().map(length).collect()
        };
        let (shape, strides) = (lengths(shape)?, lengths(strides)?);
        (shape.len() == strides.len()).then_some(TensorRecord {
            storage: storage.key.clone(),
            dtype: storage.dtype,
            elements: storage.elements,
            offset: usize::try_from(*offset).ok()?,
            shape,
            strides,
        })
    }

    fn build(&mut self) -> Result<()> {
        let state = self.pop()?;
        // The order of bytes: `(version, order, ...)`.
        let order = self.items(&state).get(1);
        let is_turned = matches!(order, Some(Value::Text(order)) if &**order == ">");
        match self.top()? {
            PickleNode::Module(attributes) => *attributes = Some(state),
            // A dictionary of tensors may have attributes: versions of modules.
            PickleNode::Dict(_) | PickleNode::NumpyArray => {}
            PickleNode::NumpyDtype(_) if is_turned => return Err(self.malformed("numbers that are not little-endian")),
            PickleNode::NumpyDtype(_) => {}
            _ => return Err(self.malformed("attributes of what has none")),
        }
        Ok(())
    }
}
