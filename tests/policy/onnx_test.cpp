// Policies as ONNX files, in the onnxruntime of python3; what is no such policy, by changes to a good file.
#include "policy/onnx.hpp"

#include <gtest/gtest.h>
#include <onnx/onnx_pb.h>

#include <cmath>
#include <functional>
#include <limits>

#include "rollout/fly_fixture.hpp"

namespace flappy::policy {
namespace {

using flight::Folder;
using flight::message;

/// One layer, 2 x + bias within [-1, 1], times 4 and plus 1: powers of two, exact in any order.
PolicyNetwork one_layer() {
  PolicyNetwork n;
  n.widths = {3, 2};
  n.linear = true;
  n.clip = 2;
  n.mean = {1, 0, 0}, n.scale = {0.5F, 1, 1};
  n.weights = {0.25F, 0.5F, 0, 0, -0.125F, 0, 0.25F, 0.125F};  // for each output its bias, then its weights
  n.middle = {1, 0}, n.half = {4, 8};
  return n;
}

std::vector<float> acts(const Policy& policy, const std::vector<float>& seen) {
  const std::size_t rows = seen.size() / static_cast<std::size_t>(policy.observations());
  std::vector<float> done(rows * static_cast<std::size_t>(policy.actions()), 99);
  policy.act(rows, seen.data(), done.data());
  return done;
}

TEST(Onnx, ActsOnRows) {
  const Folder folder;
  const std::string bytes = onnx_model(one_layer(), {{"task", "a task"}});
  EXPECT_EQ(bytes, onnx_model(one_layer(), {{"task", "a task"}}));
  const auto policy = load_policy(folder.write("p.onnx", bytes), 3, 2);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> seen = {2,     4, 1,       // 0.5; clipped to 2; 1: sums 0.5 and 0.5
                                   1e30F, 0, -1e30F,  // clipped to 2 and -2: sums 1.25, which the end clips, and -0.375
                                   nan,   0, 0,       // refused
                                   1,     0, 0};
  EXPECT_EQ(acts(*policy, seen), (std::vector<float>{3, 4, 5, -3, 0, 0, 2, -1}));
  EXPECT_EQ(acts(*policy, {2, 4, 1}), (std::vector<float>{3, 4}));
  onnx::ModelProto model;
  ASSERT_TRUE(model.ParseFromString(bytes));
  EXPECT_EQ(model.opset_import(0).version(), kOnnxOpset);
  EXPECT_EQ(model.metadata_props(0).key() + " " + model.metadata_props(0).value(), "task a task");
}

/// One unit whose sums are worked out by hand: seen (1, -2, x), kept (0, 0, h).
TEST(Onnx, Remembers) {
  const Folder folder;
  PolicyNetwork n;
  n.widths = {1, 1, 1};
  n.recurrent = true;
  n.mean = {0}, n.scale = {1}, n.clip = 10;
  n.weights = {1, 0, -2, 0, 0, 1, /**/ 0, 0, 0, 0, 0, 1, /**/ 0, 1};
  n.middle = {0}, n.half = {2};
  const auto policy = load_policy(folder.write("p.onnx", onnx_model(n, {})), 1, 1);
  ASSERT_EQ(policy->memory(), 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> seen = {1, 0.5F, nan, 0.25F};
  std::vector<float> made(4);
  policy->act(2, seen.data(), made.data());
  const double reset = 1 / (1 + std::exp(-1.0)), update = 1 / (1 + std::exp(2.0));
  const double next = (1 - update) * std::tanh(1 + reset * 0.5) + update * 0.5;
  EXPECT_NEAR(made[1], next, 1e-6);
  EXPECT_NEAR(made[0], 2 * std::tanh(next), 1e-6);
  EXPECT_EQ(made[2], 0);      // refused
  EXPECT_EQ(made[3], 0.25F);  // and remembered as it was
}

/// Also from 8.2 to 9, where the runtime's own tanh is larger than 1.
TEST(Onnx, StaysWithinTheRangeOfActions) {
  const Folder folder;
  PolicyNetwork n;
  n.widths = {1, 1};
  n.clip = 100;
  n.mean = {0}, n.scale = {1}, n.weights = {0, 1}, n.middle = {0.5F}, n.half = {3};
  const auto policy = load_policy(folder.write("p.onnx", onnx_model(n, {})), 1, 1);
  std::vector<float> seen;
  for (float x = 8; x < 9.5F; x += 1e-4F) seen.insert(seen.end(), {x, -x});
  for (float x = 9.5F; x < 200; x *= 1.01F) seen.insert(seen.end(), {x, -x});
  float low = 0, high = 0;
  for (const float a : acts(*policy, seen)) low = std::min(low, a), high = std::max(high, a);
  EXPECT_EQ(high, 3.5F);
  EXPECT_EQ(low, -2.5F);
}

/// Layer norm, and each activation, against their definitions in double precision.
TEST(Onnx, HasEveryActivationAndLayerNorm) {
  const Folder folder;
  const std::vector<float> seen = {0.5F, -1.5F, 3, -0.25F, 2, -0.75F};
  for (const Activation hidden : {Activation::relu, Activation::tanh, Activation::elu, Activation::silu})
    for (const bool layer_norm : {false, true}) {
      PolicyNetwork n;
      n.widths = {3, 2, 1};
      n.hidden = hidden;
      n.layer_norm = layer_norm;
      n.clip = 10;
      n.mean = {0, 0, 0}, n.scale = {1, 1, 1};
      n.weights = {0.1F, 1, 0.5F, -0.25F, -0.2F, 0.75F, -1, 0.5F};
      if (layer_norm) n.weights.insert(n.weights.end(), {1.5F, 0.5F, 0.1F, -0.3F});
      n.weights.insert(n.weights.end(), {0.05F, 0.6F, -0.9F});
      n.middle = {0}, n.half = {1};
      const auto policy = load_policy(folder.write("p.onnx", onnx_model(n, {})), 3, 1);
      const std::vector<float> done = acts(*policy, seen);
      for (std::size_t row = 0; row < 2; ++row) {
        double y[2];
        for (std::size_t o = 0; o < 2; ++o) {
          y[o] = static_cast<double>(n.weights[4 * o]);
          for (std::size_t i = 0; i < 3; ++i)
            y[o] += static_cast<double>(n.weights[4 * o + 1 + i]) * static_cast<double>(seen[3 * row + i]);
        }
        if (layer_norm) {
          const double mean = (y[0] + y[1]) / 2, root = std::sqrt(std::pow((y[0] - y[1]) / 2, 2) + 1e-5);
          for (std::size_t o = 0; o < 2; ++o)
            y[o] =
                (y[o] - mean) / root * static_cast<double>(n.weights[8 + o]) + static_cast<double>(n.weights[10 + o]);
        }
        for (double& x : y) {
          if (hidden == Activation::relu) x = std::max(x, 0.0);
          if (hidden == Activation::tanh) x = std::tanh(x);
          if (hidden == Activation::elu) x = x > 0 ? x : std::expm1(x);
          if (hidden == Activation::silu) x = x / (1 + std::exp(-x));
        }
        const float* last = &n.weights[n.weights.size() - 3];
        const double wanted = std::tanh(static_cast<double>(last[0]) + static_cast<double>(last[1]) * y[0] +
                                        static_cast<double>(last[2]) * y[1]);
        EXPECT_NEAR(static_cast<double>(done[row]), wanted, 1e-6) << name_of(hidden) << layer_norm << row;
      }
    }
}

TEST(Onnx, RefusesWhatDoesNotFit) {
  const Folder folder;
  const std::string name = folder / "p.onnx", sizes = "; accepted: float[n][3] to float[n][2], as the task has";
  const auto said_of = [&](const std::function<void(onnx::ModelProto&)>& change, int inputs = 3, int outputs = 2) {
    onnx::ModelProto model;
    EXPECT_TRUE(model.ParseFromString(onnx_model(one_layer(), {})));
    change(model);
    folder.write("p.onnx", model.SerializeAsString());
    return message([&] { load_policy(name, inputs, outputs); });
  };
  const auto as_it_is = [](onnx::ModelProto&) {};
  const auto shape_of = [](onnx::ValueInfoProto* value) {
    return value->mutable_type()->mutable_tensor_type()->mutable_shape();
  };
  EXPECT_EQ(said_of(as_it_is), "accepted");
  EXPECT_EQ(said_of(as_it_is, 4),
            name + ": observation is tensor(float)[n, 3]; accepted: float[n][4] to float[n][2], as the task has");
  EXPECT_EQ(said_of(as_it_is, 3, 4),
            name + ": action is tensor(float)[n, 2]; accepted: float[n][3] to float[n][4], as the task has");
  EXPECT_EQ(said_of([](onnx::ModelProto& m) {
              m.mutable_opset_import(0)->set_version(99);
            }).find(name + ": is not read by onnxruntime: "),
            0u);
  // one row at a time, as many exporters leave it
  EXPECT_EQ(said_of([&](onnx::ModelProto& m) {
              shape_of(m.mutable_graph()->mutable_input(0))->mutable_dim(0)->set_dim_value(1);
              shape_of(m.mutable_graph()->mutable_output(0))->mutable_dim(0)->set_dim_value(1);
            }),
            "accepted");
  EXPECT_EQ(said_of([&](onnx::ModelProto& m) {
              shape_of(m.mutable_graph()->mutable_input(0))->mutable_dim(0)->set_dim_value(7);
              shape_of(m.mutable_graph()->mutable_output(0))->mutable_dim(0)->set_dim_value(7);
            }),
            name + ": observation is tensor(float)[7, 3]" + sizes);
  EXPECT_EQ(said_of([](onnx::ModelProto& m) {  // the sign of all outputs as a second output
              *m.mutable_graph()->add_output() = m.graph().output(0);
              m.mutable_graph()->mutable_output(1)->set_name("answer");
            }),
            name +
                ": has 2 outputs; accepted: one input and one output, float[n][3] to float[n][2], as the task has; or "
                "two of each, with the memory second");
  EXPECT_EQ(said_of([&](onnx::ModelProto& m) {  // a memory of 5 numbers that is one of 2 afterwards
              *m.mutable_graph()->add_input() = m.graph().input(0);
              m.mutable_graph()->mutable_input(1)->set_name("memory");
              shape_of(m.mutable_graph()->mutable_input(1))->mutable_dim(1)->set_dim_value(5);
              *m.mutable_graph()->add_output() = m.graph().output(0);
              m.mutable_graph()->mutable_output(1)->set_name("answer");
            }),
            name + ": answer is tensor(float)[n, 2]; accepted: a memory of float[n][units], as wide before as after");
  EXPECT_EQ(said_of([](onnx::ModelProto& m) {
              auto* cast = m.mutable_graph()->add_node();
              cast->set_op_type("Cast");
              cast->add_input("action");
              cast->add_output("doubles");
              auto* to = cast->add_attribute();
              to->set_name("to");
              to->set_type(onnx::AttributeProto::INT);
              to->set_i(onnx::TensorProto::DOUBLE);
              auto* value = m.mutable_graph()->mutable_output(0);
              value->set_name("doubles");
              value->mutable_type()->mutable_tensor_type()->set_elem_type(onnx::TensorProto::DOUBLE);
            }),
            name + ": doubles is tensor(double)[n, 2]" + sizes);
  folder.write("p.onnx", "no protobuf");
  const std::string damaged = message([&] { load_policy(name, 3, 2); });
  EXPECT_EQ(damaged.find(name + ": is not read by onnxruntime: "), 0u) << damaged;
  EXPECT_EQ(message([&] { load_policy(folder / "gone.onnx", 3, 2); }),
            std::string(folder / "gone.onnx") + ": cannot be read: No such file or directory");
}

TEST(Onnx, SaysWhereThereIsNoRuntime) {
  const Folder folder;
  const std::string name = folder.write("p.onnx", onnx_model(one_layer(), {})), before = getenv("PATH");
  const auto said_with = [&](const std::string& path) {
    setenv("PATH", path.c_str(), 1);
    const std::string said = message([&] { load_policy(name, 3, 2); }), version = onnxruntime_version();
    setenv("PATH", before.c_str(), 1);
    EXPECT_EQ(version, "");
    return said;
  };
  const std::string accepted = "; accepted: python3 in PATH with the package onnxruntime; or a C header (.h)";
  EXPECT_EQ(said_with(folder / ""), name + ": cannot be flown: python3: No such file or directory" + accepted);
  EXPECT_EQ(said_with("/usr/bin"), name + ": cannot be flown: python3: No module named 'onnxruntime'" + accepted);
  EXPECT_NE(onnxruntime_version(), "");
}

}  // namespace
}  // namespace flappy::policy
