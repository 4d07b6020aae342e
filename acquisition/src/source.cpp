// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

void SampleBatch::add(double sample_time_s, std::span<const double> sample) {
  time_s.push_back(sample_time_s);
  values.insert(values.end(), sample.begin(), sample.end());
}

void SampleBatch::append(const SampleBatch& later) {
  time_s.insert(time_s.end(), later.time_s.begin(), later.time_s.end());
  values.insert(values.end(), later.values.begin(), later.values.end());
}

void Source::request(const DesignEntry* /*entry*/, bool /*warned*/) {}

void Source::set_free_motion(bool /*by_rests*/) {}

void Source::play(const Experiment& /*experiment*/) {}

}  // namespace axiscal
