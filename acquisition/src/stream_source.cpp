// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/stream_source.hpp"

namespace axiscal {

StreamSource::StreamSource(const SourceAddress& address, std::unique_ptr<ByteLink> link)
    : name_(address.text),
      link_(std::move(link)),
      decoder_(make_decoder(address)),
      clock_(address) {
  decoder_->restart(link_->joins_midway());
}

SourceReport StreamSource::read(SampleBatch& batch, std::chrono::milliseconds patience) {
  bytes_.clear();
  const LinkReport link = link_->read(bytes_, patience);
  SourceReport report{.state = link.state, .message = link.message, .bytes = bytes_.size()};
  if (link.reopened) {
    decoder_->restart(true);
  }
  const bool ends_line =
      decoder_->is_text() && (link_->has_messages() || link.state == LinkState::ended);
  if (ends_line && !bytes_.empty() && bytes_.back() != '\n') {
    bytes_ += '\n';
  } else if (link.state == LinkState::ended) {
    bytes_ = "\n";
  }
  const double arrival_s = session_seconds();
  const DecoderSink sink{.sample =
                             [&](std::span<const double> values) {
                               if (!clock_knows_channels_) {
                                 clock_.set_channels(decoder_->channels());
                                 clock_knows_channels_ = true;
                               }
                               clock_.append(values, arrival_s, batch, report);
                             },
                         .defect = [&] { ++report.defects; }};
  decoder_->decode(bytes_, sink);
  return report;
}

}  // namespace axiscal
