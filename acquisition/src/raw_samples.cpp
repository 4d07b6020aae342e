// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/raw_samples.hpp"

#include "core/json_document.hpp"

namespace axiscal {
namespace {

constexpr std::size_t samples_a_line = 256;
constexpr std::size_t most_waiting_samples = 1U << 16U;

}  // namespace

void RawSamples::set_channels(const std::vector<Channel>& channels) {
  channels_.clear();
  for (const Channel& channel : channels) {
    channels_.push_back(channel.name);
  }
}

bool RawSamples::add(double time_s, std::span<const double> values) {
  time_s_.push_back(time_s);
  values_.emplace_back(values.begin(), values.end());
  return time_s_.size() % samples_a_line == 0;
}

std::string RawSamples::flush(Journal& journal) {
  const Json entry = {
      {"entry", "raw"}, {"channels", channels_}, {"time", time_s_}, {"values", values_}};
  std::string why = journal.append_without_sync(entry.dump());
  if (why.empty() || time_s_.size() > most_waiting_samples) {  // limits the memory
    time_s_.clear();
    values_.clear();
  }
  return why;
}

}  // namespace axiscal
