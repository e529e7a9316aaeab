#pragma once

namespace flappy::policy {

/// relu: max(x, 0); elu: x above 0, exp(x) - 1 below; silu: x / (1 + exp(-x)).
enum class Activation { relu, tanh, elu, silu };

inline constexpr const char* kActivationNames[] = {"relu", "tanh", "elu", "silu"};  // in the order of Activation

inline const char* name_of(Activation a) { return kActivationNames[static_cast<int>(a)]; }

/// Added to the variance in layer norm before taking the root, as in torch's LayerNorm.
inline constexpr double kLayerNormEpsilon = 1e-5;

}  // namespace flappy::policy
