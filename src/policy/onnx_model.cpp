// The plugin that writes ONNX files. Operators: https://onnx.ai/onnx/operators, those of opset kOnnxOpset.
#include <onnx/checker.h>
#include <onnx/onnx_pb.h>

#include <string>
#include <vector>

#include "policy/onnx.hpp"

namespace flappy::policy {
namespace {

constexpr int kIrVersion = 8;  // ONNX 1.12 has this version and brought kOnnxOpset

class Graph {
 public:
  explicit Graph(onnx::GraphProto& graph) : graph_(graph) {}

  /// Adds a tensor of constants and returns its name; without dimensions, a scalar.
  std::string constant(const std::string& name, const std::vector<std::int64_t>& dimensions,
                       const std::vector<float>& numbers) {
    onnx::TensorProto* tensor = graph_.add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::FLOAT);
    for (const std::int64_t n : dimensions) tensor->add_dims(n);
    for (const float x : numbers) tensor->add_float_data(x);
    return name;
  }

  /// Adds a node and returns it; the name of its only output is output_of().
  onnx::NodeProto& node(const std::string& type, const std::vector<std::string>& inputs, const std::string& output) {
    onnx::NodeProto* n = graph_.add_node();
    n->set_op_type(type);
    n->set_name(output);
    for (const std::string& input : inputs) n->add_input(input);
    n->add_output(output);
    return *n;
  }

 private:
  onnx::GraphProto& graph_;
};

void set(onnx::NodeProto& node, const char* name, std::int64_t value) {
  onnx::AttributeProto* a = node.add_attribute();
  a->set_name(name);
  a->set_type(onnx::AttributeProto::INT);
  a->set_i(value);
}

void set(onnx::NodeProto& node, const char* name, float value) {
  onnx::AttributeProto* a = node.add_attribute();
  a->set_name(name);
  a->set_type(onnx::AttributeProto::FLOAT);
  a->set_f(value);
}

void set_axes(onnx::NodeProto& node, std::int64_t axis) {
  onnx::AttributeProto* a = node.add_attribute();
  a->set_name("axes");
  a->set_type(onnx::AttributeProto::INTS);
  a->add_ints(axis);
}

/// Declares float[n][width].
void declare(onnx::ValueInfoProto* value, const char* name, int width) {
  value->set_name(name);
  onnx::TypeProto_Tensor* type = value->mutable_type()->mutable_tensor_type();
  type->set_elem_type(onnx::TensorProto::FLOAT);
  type->mutable_shape()->add_dim()->set_dim_param("n");
  type->mutable_shape()->add_dim()->set_dim_value(width);
}

/// Adds the activation of `x` and returns its name.
std::string activated(Graph& graph, Activation kind, const std::string& x, const std::string& name) {
  switch (kind) {
    case Activation::relu:
      graph.node("Relu", {x}, name);
      break;
    case Activation::tanh:
      graph.node("Tanh", {x}, name);
      break;
    case Activation::elu:
      graph.node("Elu", {x}, name);
      break;
    case Activation::silu:
      graph.node("Sigmoid", {x}, name + "_gate");
      graph.node("Mul", {x, name + "_gate"}, name);
      break;
  }
  return name;
}

std::string write(const PolicyNetwork& n, const OnnxMetadata& metadata) {
  onnx::ModelProto model;
  model.set_ir_version(kIrVersion);
  model.set_producer_name("flappy-export");
  model.add_opset_import()->set_version(kOnnxOpset);
  for (const auto& [key, value] : metadata) {
    onnx::StringStringEntryProto* entry = model.add_metadata_props();
    entry->set_key(key);
    entry->set_value(value);
  }
  onnx::GraphProto* proto = model.mutable_graph();
  proto->set_name("policy");
  declare(proto->add_input(), "observation", n.observations());
  if (n.recurrent) declare(proto->add_input(), "memory", n.memory());
  declare(proto->add_output(), "action", n.actions());
  if (n.recurrent) declare(proto->add_output(), "next_memory", n.memory());
  Graph graph(*proto);

  graph.node("Sub", {"observation", graph.constant("mean", {n.observations()}, n.mean)}, "centred");
  graph.node("Mul", {"centred", graph.constant("scale", {n.observations()}, n.scale)}, "scaled");
  graph.node("Clip", {"scaled", graph.constant("lowest", {}, {-n.clip}), graph.constant("highest", {}, {n.clip})},
             "normalised");
  std::string x = "normalised";
  const float* weights = n.weights.data();
  const auto take = [&](std::size_t count) { return std::vector<float>(weights, weights + count); };
  /// Adds the sums of a layer's outputs over `of` and returns their name.
  const auto sums = [&](const std::string& of, int inputs, int outputs, const std::string& number) {
    std::vector<float> bias, weight;
    for (int o = 0; o < outputs; ++o) {  // for each output its bias, then one weight for each input
      bias.push_back(*weights++);
      weight.insert(weight.end(), weights, weights + inputs);
      weights += inputs;
    }
    onnx::NodeProto& sum = graph.node("Gemm",
                                      {of, graph.constant("weight" + number, {outputs, inputs}, weight),
                                       graph.constant("bias" + number, {outputs}, bias)},
                                      "sum" + number);
    set(sum, "transB", std::int64_t{1});
    return "sum" + number;
  };
  if (n.recurrent) {
    const int units = n.memory();
    const std::string seen = sums(x, n.observations(), 3 * units, "_seen");
    const std::string kept = sums("memory", units, 3 * units, "_kept");
    for (const std::string& of : {seen, kept}) {
      onnx::NodeProto& parts = graph.node("Split", {of}, of + "_reset");
      for (const char* part : {"_update", "_new"}) parts.add_output(of + part);
      set(parts, "axis", std::int64_t{1});
    }
    for (const std::string gate : {"reset", "update"}) {
      graph.node("Add", {seen + "_" + gate, kept + "_" + gate}, gate + "_sum");
      graph.node("Sigmoid", {gate + "_sum"}, gate);
    }
    graph.node("Mul", {"reset", kept + "_new"}, "recalled");
    graph.node("Add", {seen + "_new", "recalled"}, "new_sum");
    graph.node("Tanh", {"new_sum"}, "new");
    graph.node("Sub", {"memory", "new"}, "change");
    graph.node("Mul", {"update", "change"}, "stays");
    graph.node("Add", {"new", "stays"}, "remembered");
    x = "remembered";
  }
  for (std::size_t layer = n.recurrent ? 1 : 0; layer + 1 < n.widths.size(); ++layer) {
    const int outputs = n.widths[layer + 1];
    const std::string number = std::to_string(layer);
    x = sums(x, n.widths[layer], outputs, number);
    const bool last = layer + 2 == n.widths.size();
    if (n.layer_norm && !last) {
      const auto width = static_cast<std::size_t>(outputs);
      const std::string gain = graph.constant("gain" + number, {outputs}, take(width));
      weights += outputs;
      const std::string shift = graph.constant("shift" + number, {outputs}, take(width));
      weights += outputs;
      set(graph.node("LayerNormalization", {x, gain, shift}, "norm" + number), "epsilon",
          static_cast<float>(kLayerNormEpsilon));
      x = "norm" + number;
    }
    if (!last) x = activated(graph, n.hidden, x, "layer" + number);
    else if (!n.linear) x = activated(graph, Activation::tanh, x, "squashed");
  }
  // after tanh too: that of a runtime may be larger than 1 (onnxruntime 1.32: 1.0000002)
  graph.node("Clip", {x, graph.constant("minus_one", {}, {-1}), graph.constant("one", {}, {1})}, "end");
  x = "end";
  graph.node("Mul", {x, graph.constant("half", {n.actions()}, n.half)}, "offset");
  graph.node("Add", {"offset", graph.constant("middle", {n.actions()}, n.middle)}, "answer");
  graph.node("IsNaN", {"observation"}, "nan");
  set(graph.node("Cast", {"nan"}, "nan_number"), "to", std::int64_t{onnx::TensorProto::FLOAT});
  set_axes(graph.node("ReduceMax", {"nan_number"}, "any_nan"), 1);
  set(graph.node("Cast", {"any_nan"}, "refused"), "to", std::int64_t{onnx::TensorProto::BOOL});
  graph.node("Where", {"refused", graph.constant("nothing", {}, {0}), "answer"}, "action");
  if (n.recurrent) graph.node("Where", {"refused", "memory", "remembered"}, "next_memory");
  onnx::checker::check_model(model);
  return model.SerializeAsString();
}

}  // namespace

const OnnxFunctions flappy_onnx_functions = {write};

}  // namespace flappy::policy
