// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Samples on their way to the journal, many to a line.
class RawSamples {
 public:
  void set_channels(const std::vector<Channel>& channels);

  /// @return whether there are enough for a line.
  bool add(double time_s, std::span<const double> values);

  /// Writes what is there, one sample or more; keeps it for the next time where that fails, up to a
  /// limit.
  /// @return why it was not written; empty where it was.
  std::string flush(Journal& journal);

  [[nodiscard]] bool is_empty() const { return time_s_.empty(); }

 private:
  std::vector<std::string> channels_;
  std::vector<double> time_s_;
  std::vector<std::vector<double>> values_;
};

}  // namespace axiscal
