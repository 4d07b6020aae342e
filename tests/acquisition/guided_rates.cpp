// SPDX-License-Identifier: Apache-2.0
// axiscal_guided_rates [SESSIONS]: prints how often a session reports wrong poses before it accepts
// them, and how often it doubts right poses. The table is in docs/acquire.md.
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "guided.hpp"

using axiscal::test::GuidedResult;

int main(int argc, char** argv) {
  const int sessions = argc > 1 ? std::atoi(argv[1]) : 200;
  const axiscal::test::ScratchFolder folder;
  struct Case {
    double slope;
    double error_rate;
  };
  std::printf(
      "slope [mrad], error rate: mistakes, announced, left in the end, false questions, "
      "sessions refused\n");
  for (const Case& one : {Case{5e-3, 0.1}, Case{0.2e-3, 0.1}, Case{5e-3, 0.0}, Case{0.2e-3, 0.0}}) {
    std::size_t mistakes = 0;
    std::size_t announced = 0;
    std::size_t same_rest = 0;
    std::size_t wrong_at_end = 0;
    std::size_t questions = 0;
    std::size_t without = 0;
    for (int s = 0; s < sessions; ++s) {
      axiscal::SimulationSetup simulation;
      simulation.seed = static_cast<std::uint64_t>(s) + 1;
      simulation.error_rate = one.error_rate;
      simulation.slope = one.slope * Eigen::Vector2d(0.8, -0.6);
      simulation.rate_hz = 50.0;
      const std::string path = folder.path("session.journal");
      const GuidedResult result =
          axiscal::test::run_guided(axiscal::test::guided_setup(simulation.seed), simulation, path);
      std::filesystem::remove(path);
      for (const axiscal::SimulatedMistake& mistake : result.mistakes) {
        ++mistakes;
        announced += mistake.was_warned ? 1U : 0U;
        same_rest += !mistake.was_warned && mistake.wanted.rest() == mistake.laid.rest() ? 1U : 0U;
        if (!mistake.was_warned && std::getenv("VERBOSE") != nullptr) {
          std::printf("  session %d: %s laid as %s\n", s + 1, mistake.wanted.name().c_str(),
                      mistake.laid.name().c_str());
        }
      }
      for (const axiscal::SessionEvent& event : result.events) {
        questions += event.kind == "question" || event.kind == "as_before" ? 1U : 0U;
      }
      if (result.calibrations.empty() ||
          result.calibrations.front().findings.status == axiscal::CalibrationStatus::refused) {
        std::printf("  session %d has no calibration\n", s + 1);
        ++without;
        continue;
      }
      const Eigen::MatrixXd off =
          result.calibrations.front().sensor.response.sensitivity - result.truth.sensitivity;
      constexpr double five_sigma = 1e-4;
      wrong_at_end += off.cwiseAbs().maxCoeff() > five_sigma ? 1U : 0U;
    }
    std::printf("%4.1f %4.2f: %zu, %.1f %%, (%zu missed on the same rest), %zu, %zu, %zu\n",
                1e3 * one.slope, one.error_rate, mistakes,
                mistakes == 0
                    ? 0.0
                    : 100.0 * static_cast<double>(announced) / static_cast<double>(mistakes),
                same_rest, wrong_at_end, questions - announced, without);
  }
  return 0;
}
