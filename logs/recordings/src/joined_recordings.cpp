// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "logs/recordings/src/opened.hpp"

namespace axiscal {
namespace {

// Decodes several files one after the other.
class MembersDecoder final : public RecordingFile::Decoder {
 public:
  explicit MembersDecoder(std::vector<DecoderPointer> members) : members_(std::move(members)) {}

  bool read(SeriesSink& sink) override {
    while (next_ < members_.size()) {
      Offset shifted(sink, first_, count_);
      if (members_[next_]->read(shifted)) {
        return true;
      }
      for (const std::string& note : members_[next_]->notes()) {
        notes_.push_back(note);
      }
      members_[next_].reset();
      ++next_;
      first_ = count_;
    }
    return false;
  }

 private:
  // Renumbers the series of a member, so that they follow those of the members before it.
  class Offset final : public SeriesSink {
   public:
    Offset(SeriesSink& sink, std::size_t first, std::size_t& count)
        : sink_(sink), first_(first), count_(count) {}
    void add(const Series& series) override {
      ++count_;
      sink_.add(series);
    }
    void sample(std::size_t series, double time_s, std::span<const double> values) override {
      sink_.sample(first_ + series, time_s, values);
    }

   private:
    SeriesSink& sink_;
    std::size_t first_;
    std::size_t& count_;
  };

  std::vector<DecoderPointer> members_;
  std::size_t next_ = 0;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace

OpenedFile joined_recordings(std::vector<OpenedFile> parts) {
  OpenedFile all;
  std::vector<DecoderPointer> decoders;
  for (OpenedFile& part : parts) {
    decoders.push_back(part.is_table() ? decoder_of_table(std::move(part))
                                       : std::move(part.decoder));
    all.format = all.format.empty() ? decoders.back()->format : all.format;
  }
  all.decoder = std::make_unique<MembersDecoder>(std::move(decoders));
  all.decoder->format = all.format;
  return all;
}

}  // namespace axiscal
