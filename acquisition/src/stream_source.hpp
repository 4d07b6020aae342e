// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "acquisition/src/byte_link.hpp"
#include "acquisition/src/decoder.hpp"
#include "acquisition/src/sample_clock.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// A source that decodes the bytes of a link.
class StreamSource final : public Source {
 public:
  StreamSource(const SourceAddress& address, std::unique_ptr<ByteLink> link);

  [[nodiscard]] const std::vector<Channel>& channels() const override {
    return decoder_->channels();
  }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] double stated_rate_hz() const override { return clock_.rate_hz(); }
  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override;

 private:
  std::string name_;
  std::unique_ptr<ByteLink> link_;
  std::unique_ptr<Decoder> decoder_;
  SampleClock clock_;
  bool clock_knows_channels_ = false;
  std::string bytes_;
};

}  // namespace axiscal
