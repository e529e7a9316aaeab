// What hidden layers may do to the sums of their inputs.
#pragma once

namespace flappy::policy {

/// relu: max(x, 0); elu: x above 0, exp(x) - 1 below; silu: x / (1 + exp(-x)).
enum class Activation { relu, tanh, elu, silu };

inline constexpr const char* kActivationNames[] = {"relu", "tanh", "elu", "silu"};  // in the order of Activation

inline const char* name_of(Activation a) { return kActivationNames[static_cast<int>(a)]; }

/// Added to a layer's variance before it is divided by its root, as torch's LayerNorm.
inline constexpr double kLayerNormEpsilon = 1e-5;

}  // namespace flappy::policy
