//! The network as an ONNX file, so that it runs wherever there is a runtime.
//!
//! Source: ONNX's `onnx.proto` (IR version 8, operators of set 13); the few messages that are needed are written here.
//! Input `image`: 1 x 3 x 224 x 384, red, green, blue from -1 to 1. Output `maps`: 1 x 14 x 56 x 96, see [`super::shape`].

use super::file::tensors;
use super::shape::{CELL, INPUT, LAYERS, LEAK, OUTPUTS, parts};

/// A protocol buffer's message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push((value & 0x7f) as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    #[must_use]
    fn int(mut self, field: u64, value: usize) -> Self {
        self.varint(field << 3);
        self.varint(value as u64);
        self
    }

    #[must_use]
    fn float(mut self, field: u64, value: f32) -> Self {
        self.varint(field << 3 | 5);
        self.0.extend(value.to_le_bytes());
        self
    }

    #[must_use]
    fn bytes(mut self, field: u64, bytes: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend(bytes);
        self
    }

    #[must_use]
    fn text(self, field: u64, text: &str) -> Self {
        self.bytes(field, text.as_bytes())
    }

    #[must_use]
    fn message(self, field: u64, message: &Message) -> Self {
        self.bytes(field, &message.0)
    }

    #[must_use]
    fn ints(self, field: u64, values: &[usize]) -> Self {
        values.iter().fold(self, |message, value| message.int(field, *value))
    }
}

/// AttributeProto's types.
const FLOAT: usize = 1;
const STRING: usize = 3;
const INTS: usize = 7;

fn ints(name: &str, values: &[usize]) -> Message {
    Message::default().text(1, name).ints(8, values).int(20, INTS)
}

fn string(name: &str, value: &str) -> Message {
    Message::default().text(1, name).text(4, value).int(20, STRING)
}

fn node(operator: &str, inputs: &[&str], output: &str, attributes: &[Message]) -> Message {
    let node = inputs.iter().fold(Message::default(), |node, input| node.text(1, input));
    let node = node.text(2, output).text(3, output).text(4, operator);
    attributes.iter().fold(node, |node, attribute| node.message(5, attribute))
}

fn tensor(name: &str, shape: &[usize], values: &[f32]) -> Message {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Message::default().ints(1, shape).int(2, 1).text(8, name).bytes(9, &raw)
}

/// A named tensor of floats and its shape.
fn value(name: &str, shape: &[usize]) -> Message {
    let dims = shape.iter().fold(Message::default(), |dims, n| dims.message(1, &Message::default().int(1, *n)));
    let kind = Message::default().int(1, 1).message(2, &dims);
    Message::default().text(1, name).message(2, &Message::default().message(1, &kind))
}

/// The file's bytes; `card` goes into its documentation.
pub fn bytes(weights: &[f32], card: &str) -> Vec<u8> {
    let mut graph = Message::default();
    let mut previous = "image".to_owned();
    let mut outputs: Vec<String> = Vec::new();
    for (i, layer) in LAYERS.iter().enumerate() {
        let last = i + 1 == LAYERS.len();
        if let Some(lateral) = layer.lateral {
            let doubled = format!("doubled_{i}");
            let attributes = [
                string("mode", "nearest"),
                string("coordinate_transformation_mode", "asymmetric"),
                string("nearest_mode", "floor"),
            ];
            graph = graph.message(1, &node("Resize", &[&previous, "", "double"], &doubled, &attributes));
            let sum = format!("sum_{i}");
            graph = graph.message(1, &node("Add", &[&doubled, &outputs[lateral]], &sum, &[]));
            previous = sum;
        }
        let conv = layer.conv;
        let name = if last { "maps".to_owned() } else { format!("conv_{i}") };
        let (weight, bias) = (format!("layer_{i}.weight"), format!("layer_{i}.bias"));
        let attributes = [
            ints("kernel_shape", &[conv.kernel; 2]),
            ints("strides", &[conv.stride; 2]),
            ints("pads", &[conv.kernel / 2; 4]),
        ];
        graph = graph.message(1, &node("Conv", &[&previous, &weight, &bias], &name, &attributes));
        let mut output = name;
        if layer.residual {
            let sum = format!("residual_{i}");
            graph = graph.message(1, &node("Add", &[&output, &previous], &sum, &[]));
            output = sum;
        }
        if !last {
            let active = format!("active_{i}");
            let leak = Message::default().text(1, "alpha").float(2, LEAK).int(20, FLOAT);
            graph = graph.message(1, &node("LeakyRelu", &[&output], &active, &[leak]));
            output = active;
        }
        outputs.push(output.clone());
        previous = output;
    }
    graph = graph.text(2, "instep detector");
    for ((name, shape), range) in tensors().iter().zip(parts().into_iter().flat_map(|(w, b)| [w, b])) {
        graph = graph.message(5, &tensor(name, shape, &weights[range]));
    }
    graph = graph.message(5, &tensor("double", &[4], &[1.0, 1.0, 2.0, 2.0]));
    let [width, height] = INPUT;
    graph = graph
        .message(11, &value("image", &[1, 3, height, width]))
        .message(12, &value("maps", &[1, OUTPUTS, height / CELL, width / CELL]));
    let operators = Message::default().text(1, "").int(2, 13);
    Message::default()
        .int(1, 8)
        .text(2, "instep")
        .text(3, env!("CARGO_PKG_VERSION"))
        .text(6, card)
        .message(7, &graph)
        .message(8, &operators)
        .0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes that protobuf's own documentation gives for the number 150 in field 1 and "testing" in field 2.
    #[test]
    fn messages_are_written_as_protobuf_has_them() {
        assert_eq!(Message::default().int(1, 150).0, [0x08, 0x96, 0x01]);
        let text = Message::default().text(2, "testing").0;
        assert_eq!(text, [0x12, 0x07, 0x74, 0x65, 0x73, 0x74, 0x69, 0x6e, 0x67]);
    }
}
