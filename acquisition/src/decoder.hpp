// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/src/source_address.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Receives the output of a decoder.
struct DecoderSink {
  /// Called for a sample: one value for each channel, NaN for a missing value.
  std::function<void(std::span<const double> values)> sample;
  /// Called for invalid input: an incomplete line, unknown text, a wrong checksum.
  std::function<void()> defect;
};

/// Converts bytes to samples. The memory use does not grow with the number of bytes.
class Decoder {
 public:
  Decoder() = default;
  virtual ~Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// @return the channels; empty until they are known.
  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }

  virtual void decode(std::string_view bytes, const DecoderSink& sink) = 0;

  /// @return true if the format consists of lines of text; false for binary frames.
  [[nodiscard]] virtual bool is_text() const { return true; }

  /// Drops incomplete input, because the next bytes do not continue the earlier ones.
  /// @param midway  true if the next bytes may begin in the middle of a line or frame.
  virtual void restart(bool midway) = 0;

 protected:
  std::vector<Channel> channels_;
};

/// Makes a decoder for binary frames or for lines of text: delimited values with or without a
/// header, JSON, or text with numbers at the places that a pattern names. Options: format, names,
/// pattern, frame.
[[nodiscard]] std::unique_ptr<Decoder> make_decoder(const SourceAddress& address);

/// @param path  file that describes the binary frames (JSON, format "axiscal-frames").
[[nodiscard]] std::unique_ptr<Decoder> make_frame_decoder(const std::string& path);

/// @return the names of the options that make_decoder() accepts.
[[nodiscard]] const std::vector<std::string>& decoder_options();

/// @return the channel whose name and unit are written as "x", "x [V]" or "x (V)".
[[nodiscard]] Channel channel_of(std::string_view text);

}  // namespace axiscal
