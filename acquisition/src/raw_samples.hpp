// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Raw samples that wait to be written to the journal. One line of the journal contains many.
class RawSamples {
 public:
  void set_channels(const std::vector<Channel>& channels);

  /// @return true if the waiting samples are enough for a line.
  bool add(double time_s, std::span<const double> values);

  /// Writes the waiting samples, one or more, as one line. If the write fails, the samples are kept
  /// for the next call, up to a limit.
  /// @return empty on success; otherwise the reason.
  std::string flush(Journal& journal);

  [[nodiscard]] bool is_empty() const { return time_s_.empty(); }

 private:
  std::vector<std::string> channels_;
  std::vector<double> time_s_;
  std::vector<std::vector<double>> values_;
};

}  // namespace axiscal
