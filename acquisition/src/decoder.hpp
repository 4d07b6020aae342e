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
  /// A sample: a value for each channel, NaN where one is missing.
  std::function<void(std::span<const double> values)> sample;
  /// Invalid input: a half line, garbage, a wrong checksum.
  std::function<void()> defect;
};

/// Turns bytes into samples, in constant memory.
class Decoder {
 public:
  Decoder() = default;
  virtual ~Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// @return the channels; empty until they are known.
  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }

  virtual void decode(std::string_view bytes, const DecoderSink& sink) = 0;

  /// @return true if the input ends with a line feed.
  [[nodiscard]] virtual bool is_text() const { return true; }

  /// The next bytes do not continue the earlier ones.
  /// @param midway  it may begin in the middle of a line or frame.
  virtual void restart(bool midway) = 0;

 protected:
  std::vector<Channel> channels_;
};

/// Lines of text: delimited with or without header, JSON, named fields by a pattern; or binary
/// frames. Options: format, names, pattern, frame.
[[nodiscard]] std::unique_ptr<Decoder> make_decoder(const SourceAddress& address);

/// @param path  of a description of binary frames (JSON, format "axiscal-frames").
[[nodiscard]] std::unique_ptr<Decoder> make_frame_decoder(const std::string& path);

/// The options that make_decoder() takes.
[[nodiscard]] const std::vector<std::string>& decoder_options();

/// @return a channel of "x", "x [V]", "x (V)" or "x/V".
[[nodiscard]] Channel channel_of(std::string_view text);

}  // namespace axiscal
