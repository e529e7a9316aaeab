#include "gap/diagnose.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What every model gets wrong, as a share of the signal.
constexpr double kFloor = 0.01;
/// Reach of the first difference along a size or a shape.
constexpr double kEffectReach = 0.4;

class Diagnoser {
 public:
  Diagnoser(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain, const DiagnoseOptions& options)
      : flights_(flights),
        uncertain_(uncertain),
        options_(options),
        threads_(options.threads > 0 ? options.threads : omp_get_num_procs()),
        evidence_(flights),
        fitter_(flights, evidence_, {kFloor, 0}, threads_) {}

  Diagnosis run() {
    Diagnosis d;
    progress(0, "fitting parameters");
    const Hypothesis plain(uncertain_, {});
    d.parameters = fit_parameters(plain);
    progress(0.3, "screening effects");
    return d;
  }

  Fit fit_parameters(const Hypothesis& plain) {
    const Linearised nominal = fitter_.linearise(plain, plain.start(), Directions{MatrixXd(plain.size(), 0), VectorXd(0)});
    evidence_.learn_weights(nominal.residual);
    Fit fit = fitter_.fit(plain, plain.start(), 3);
    for (int i = 0; i < 2; ++i) {
      evidence_.learn_weights(fit.point.residual);
      fit = fitter_.refit(plain, fit, 3);
    }
    evidence_.learn_noise(fit.point.residual);
    return fitter_.refit(plain, fit, 3);
  }

 private:
  void progress(double share, const std::string& what) const {
    if (options_.progress) options_.progress(share, what);
  }

  const std::vector<CarriedFlight>& flights_;
  const sim::Randomisation& uncertain_;
  const DiagnoseOptions& options_;
  int threads_;
  Evidence evidence_;
  Fitter fitter_;
};

}  // namespace

Diagnosis diagnose(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options) {
  return Diagnoser(flights, uncertain, options).run();
}

}  // namespace flappy::gap
