//! A policy as ONNX: what other people's programs load. Written by hand: a dozen fields of its protobuf
//! (onnx.proto, IR version 8, operator set 13) are all that a perceptron needs.
//!
//! `tools/check_policy.py` runs the file in ONNX Runtime and compares.
//!
//! Input `observation` (samples x observations, f32, as [`instep_kick::policy::Follower`] lays it out, not normalised), output
//! `action` (samples x joints). Nodes: Sub, Div, Clip, then Gemm and Elu or Relu layer by layer.

use instep_kick::policy::{Activation, Network, Normalizer};

/// The file's bytes.
#[must_use]
pub fn model(network: &Network) -> Vec<u8> {
    let (inputs, outputs) = (network.inputs(), network.outputs());
    let mut graph = Message::default();
    let mut initializers = Message::default();
    let normalizer = &network.normalizer;
    initializers.message(5, &tensor("mean", &[inputs], &normalizer.mean));
    initializers.message(5, &tensor("deviation", &[inputs], &normalizer.deviation));
    initializers.message(5, &tensor("least", &[], &[-Normalizer::CLIP]));
    initializers.message(5, &tensor("most", &[], &[Normalizer::CLIP]));
    graph.message(1, &node("Sub", &["observation", "mean"], "centred", &[]));
    graph.message(1, &node("Div", &["centred", "deviation"], "scaled", &[]));
    graph.message(1, &node("Clip", &["scaled", "least", "most"], "layer_0", &[]));
    let last = network.layers.len().saturating_sub(1);
    let mut width = inputs;
    for (i, layer) in network.layers.iter().enumerate() {
        let (weight, bias, from) = (format!("weight_{i}"), format!("bias_{i}"), format!("layer_{i}"));
        initializers.message(5, &tensor(&weight, &[layer.bias.len(), width], &layer.weight));
        initializers.message(5, &tensor(&bias, &[layer.bias.len()], &layer.bias));
        let sum = if i == last { "action".to_owned() } else { format!("sum_{i}") };
        graph.message(1, &node("Gemm", &[&from, &weight, &bias], &sum, &[("transB", 1)]));
        if i < last {
            let kind = match network.activation {
                Activation::Relu => "Relu",
                Activation::Elu => "Elu",
            };
            graph.message(1, &node(kind, &[&sum], &format!("layer_{}", i + 1), &[]));
        }
        width = layer.bias.len();
    }
    graph.text(2, "policy");
    graph.bytes.append(&mut initializers.bytes);
    graph.message(11, &value("observation", inputs));
    graph.message(12, &value("action", outputs));

    let mut operators = Message::default();
    operators.text(1, "");
    operators.number(2, 13);
    let mut model = Message::default();
    model.number(1, 8);
    model.text(2, "instep");
    model.message(7, &graph);
    model.message(8, &operators);
    model.bytes
}

/// A protobuf message under construction.
#[derive(Debug, Default)]
struct Message {
    bytes: Vec<u8>,
}

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push((value & 0x7F) as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    fn number(&mut self, field: u64, value: u64) {
        self.varint(field << 3);
        self.varint(value);
    }

    fn raw(&mut self, field: u64, value: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(value.len() as u64);
        self.bytes.extend_from_slice(value);
    }

    fn text(&mut self, field: u64, value: &str) {
        self.raw(field, value.as_bytes());
    }

    fn message(&mut self, field: u64, value: &Self) {
        self.raw(field, &value.bytes);
    }
}

/// NodeProto.
fn node(kind: &str, inputs: &[&str], output: &str, integers: &[(&str, u64)]) -> Message {
    let mut node = Message::default();
    inputs.iter().for_each(|input| node.text(1, input));
    node.text(2, output);
    node.text(3, output);
    node.text(4, kind);
    for (name, value) in integers {
        let mut attribute = Message::default();
        attribute.text(1, name);
        attribute.number(3, *value);
        attribute.number(20, 2);
        node.message(5, &attribute);
    }
    node
}

/// TensorProto of floats.
fn tensor(name: &str, shape: &[usize], values: &[f32]) -> Message {
    let mut tensor = Message::default();
    shape.iter().for_each(|&size| tensor.number(1, size as u64));
    tensor.number(2, 1);
    tensor.text(8, name);
    tensor.raw(9, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>());
    tensor
}

/// ValueInfoProto of a matrix of floats with any number of rows.
fn value(name: &str, columns: usize) -> Message {
    let (mut rows, mut width, mut shape) = (Message::default(), Message::default(), Message::default());
    rows.text(2, "samples");
    width.number(1, columns as u64);
    shape.message(1, &rows);
    shape.message(1, &width);
    let (mut matrix, mut kind, mut value) = (Message::default(), Message::default(), Message::default());
    matrix.number(1, 1);
    matrix.message(2, &shape);
    kind.message(1, &matrix);
    value.text(1, name);
    value.message(2, &kind);
    value
}
