// SPDX-License-Identifier: Apache-2.0
// Simulates calibrations with one deliberate mistake each. Counts how often a warning is given, how
// often the warning names the right mistake, and how often runs without a mistake are reported as
// wrong. The table in docs/accuracy.md shows the results.
// Usage: axiscal_culprit_rates [TRIALS [SEED [moved]]]. A third argument omits run_mistakes().
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/error.hpp"
#include "mistakes.hpp"
#include "scenario.hpp"

namespace {

using axiscal::test::Mistake;

struct Case {
  Mistake mistake = Mistake::none;
  double sigmas = 0.0;
  Eigen::Vector3d ratio = Eigen::Vector3d::Ones();
  std::optional<axiscal::Method> method;
  bool stated_ratio = false;
  int replicates = 1;  // replicates of the 12 design points
  // True: one reading is moved in a random direction by `sigmas` standard deviations of the noise.
  bool moved = false;
};

const Eigen::Vector3d unequal(1.0, 1.0, 3.0);

void run(const Case& one, int trials, std::uint64_t seed) {
  constexpr double noise = 1e-4;
  int caught = 0;
  int named = 0;
  int refused = 0;
  axiscal::RandomStream random(seed, static_cast<std::uint32_t>(one.mistake));
  for (int t = 0; t < trials; ++t) {
    const axiscal::test::RandomRun good =
        axiscal::test::random_run(noise * one.ratio, random, one.replicates);
    const axiscal::test::SeededMistake seeded =
        one.moved ? axiscal::test::move_reading(one.sigmas * noise * one.ratio, good.good, random)
                  : axiscal::test::seed_mistake(one.mistake, one.sigmas * noise, good.truth,
                                                good.good, random);
    axiscal::Experiment experiment = axiscal::test::experiment_for(good.truth);
    experiment.field.in_table.reset();
    experiment.fit.method = one.method;
    if (one.stated_ratio) {
      experiment.fit.noise_ratio = one.ratio;
    }
    try {
      const axiscal::Calibration result = axiscal::calibrate(experiment, seeded.observations);
      const axiscal::test::Verdict verdict = axiscal::test::judge(result, seeded);
      caught += verdict.caught ? 1 : 0;
      named += verdict.named ? 1 : 0;
      refused += result.findings.status == axiscal::CalibrationStatus::refused ? 1 : 0;
    } catch (const axiscal::Error& error) {
      std::printf("  %s\n", error.what());
    }
  }
  const auto percent = [&](int count) { return 100.0 * count / trials; };
  std::printf(
      "%-16s %5.0f  12 x %d  %g:%g:%g %-6s  caught %6.2f %%  named %6.2f %%  refused %6.2f %%\n",
      one.moved ? "reading moved" : axiscal::test::name_of(one.mistake), one.sigmas, one.replicates,
      one.ratio.x(), one.ratio.y(), one.ratio.z(), one.stated_ratio ? "stated" : "",
      percent(caught), percent(named), percent(refused));
  std::fflush(stdout);
}

// Simulates mistakes of the user in runs of 12 readings.
void run_mistakes(int trials, std::uint64_t seed) {
  run({}, trials, seed);
  run({.ratio = unequal}, trials, seed);
  run({.ratio = unequal, .stated_ratio = true}, trials, seed);
  for (const Mistake mistake :
       {Mistake::wrong_face, Mistake::upside_down, Mistake::wrong_way_round, Mistake::exchanged,
        Mistake::unit_factor, Mistake::repeat, Mistake::columns, Mistake::sign}) {
    run({.mistake = mistake}, trials, seed);
  }
  for (const bool stated : {false, true}) {
    const auto sizes = [&](Mistake mistake, std::initializer_list<double> all) {
      for (const double sigmas : all) {
        run({.mistake = mistake, .sigmas = sigmas, .stated_ratio = stated}, trials, seed);
      }
    };
    sizes(Mistake::tilt, {5.0, 8.0, 10.0, 15.0});
    sizes(Mistake::table_moved, {5.0, 10.0});
    sizes(Mistake::drift, {10.0, 20.0});
    sizes(Mistake::saturation, {8.0, 10.0});
  }
}

// Simulates one moved reading in runs of 12 to 96 readings. The axes have equal or different noise.
void run_moved_readings(int trials, std::uint64_t seed) {
  for (const int replicates : {1, 2, 4, 8}) {
    for (const Eigen::Vector3d& ratio :
         {Eigen::Vector3d(1.0, 1.0, 1.0), unequal, Eigen::Vector3d(1.0, 3.0, 10.0)}) {
      run({.ratio = ratio, .replicates = replicates}, trials, seed);
      run({.sigmas = 10.0, .ratio = ratio, .replicates = replicates, .moved = true}, trials, seed);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 1000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const bool moved_alone = argc > 3;
  if (!moved_alone) {
    run_mistakes(trials, seed);
  }
  run_moved_readings(trials, seed);
  return 0;
}
