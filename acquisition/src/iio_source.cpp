// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <thread>

#include "acquisition/src/device_sources.hpp"
#include "acquisition/src/sample_clock.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"

#ifdef AXISCAL_IIO
#include <iio.h>

#include "core/formatted.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_IIO
namespace {

constexpr unsigned answer_within_ms = 2000;
constexpr double retry_after_s = 1.0;

struct ContextDeleter {
  void operator()(iio_context* context) const { iio_context_destroy(context); }
};
struct BufferDeleter {
  void operator()(iio_buffer* buffer) const { iio_buffer_destroy(buffer); }
};

std::string error_text(int error) {
  std::array<char, 256> text{};
  iio_strerror(std::abs(error), text.data(), text.size());
  return text.data();
}

// The unit of a channel, and the factor that converts the value from IIO to this unit.
struct Unit {
  std::string_view prefix;
  std::string_view unit;
  double factor;
};
constexpr std::array units = {Unit{"accel", "m/s^2", 1.0},    Unit{"anglvel", "rad/s", 1.0},
                              Unit{"magn", "uT", 100.0},      Unit{"temp", "degC", 1e-3},
                              Unit{"voltage", "V", 1e-3},     Unit{"current", "A", 1e-3},
                              Unit{"illuminance", "lx", 1.0}, Unit{"incli", "deg", 1.0}};

struct IioChannel {
  iio_channel* channel = nullptr;
  double scale = 1.0;
  double offset = 0.0;
  double unit = 1.0;  // factor that converts the attribute `input` to the channel's unit
  bool is_time = false;
};

class IioSource final : public Source {
 public:
  explicit IioSource(const SourceAddress& address)
      : name_(address.text),
        uri_(address.place.empty() ? "local:" : address.place),
        wanted_device_(address.text_or("device", "")),
        wanted_channels_(address.names("channels")),
        names_(address.names("names")),
        samples_(static_cast<std::size_t>(address.number_or("buffer", 64.0, 1.0, 65536.0))),
        poll_hz_(address.number_or("poll", 0.0, 0.1, 1000.0)),
        clock_(address) {
    if (!names_.empty() && names_.size() != wanted_channels_.size()) {
      address.fail("names= must have as many entries as channels=");
    }
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] double stated_rate_hz() const override { return clock_.rate_hz(); }

  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override {
    SourceReport report;
    const double now = session_seconds();
    if (!context_) {
      if (now < next_try_s_) {
        std::this_thread::sleep_for(patience);
      } else {
        next_try_s_ = now + retry_after_s;
        message_ = connect();
        was_open_ = was_open_ || message_.empty();
      }
      report.state = context_ ? LinkState::open : was_open_ ? LinkState::lost : LinkState::waiting;
      report.message = message_;
      return report;
    }
    const int error = poll_hz_ > 0.0 ? poll(batch, report, patience) : refill(batch, report);
    if (error < 0) {
      message_ = formatted("{}: {}", name_, error_text(error));
      disconnect();
      next_try_s_ = session_seconds() + retry_after_s;
      report.state = LinkState::lost;
      report.message = message_;
    }
    return report;
  }

 private:
  void disconnect() {
    buffer_.reset();
    context_.reset();
    read_.clear();
  }

  std::string connect() {
    context_.reset(iio_create_context_from_uri(uri_.c_str()));
    if (!context_) {
      return formatted("{}: the IIO context cannot be opened: {}", name_, error_text(errno));
    }
    std::string why = set_up();
    if (!why.empty()) {
      disconnect();
    }
    return why;
  }

  std::string set_up() {
    iio_context_set_timeout(context_.get(), answer_within_ms);
    iio_device* device = nullptr;
    std::vector<std::string> there;
    for (unsigned i = 0; i < iio_context_get_devices_count(context_.get()); ++i) {
      iio_device* const one = iio_context_get_device(context_.get(), i);
      const char* const label = iio_device_get_name(one);
      const std::string id = iio_device_get_id(one);
      const std::string device_name = label != nullptr ? label : "";
      there.push_back(device_name.empty() ? id : device_name);
      const bool wanted = wanted_device_.empty()
                              ? has_channels(*one)
                              : wanted_device_ == id || wanted_device_ == device_name;
      device = device == nullptr && wanted ? one : device;
    }
    if (device == nullptr) {
      return formatted("{}: {}{}", name_,
                       wanted_device_.empty() ? "no device with input channels"
                                              : formatted("no device '{}'", wanted_device_),
                       there.empty() ? "" : "; the devices are " + joined(there));
    }
    const std::string why = choose_channels(*device);
    if (!why.empty() || poll_hz_ > 0.0) {
      return why;
    }
    buffer_.reset(iio_device_create_buffer(device, samples_, false));
    if (!buffer_) {
      return formatted(
          "{}: the buffer cannot be created ({}); if the device has no trigger, set poll=HZ", name_,
          error_text(errno));
    }
    return "";
  }

  [[nodiscard]] bool has_channels(const iio_device& device) const {
    for (unsigned i = 0; i < iio_device_get_channels_count(&device); ++i) {
      const iio_channel* const channel = iio_device_get_channel(&device, i);
      if (!iio_channel_is_output(channel) &&
          (poll_hz_ > 0.0 || iio_channel_is_scan_element(channel))) {
        return true;
      }
    }
    return false;
  }

  std::string choose_channels(iio_device& device) {
    std::vector<Channel> channels;
    std::vector<std::string> there;
    for (unsigned i = 0; i < iio_device_get_channels_count(&device); ++i) {
      iio_channel* const channel = iio_device_get_channel(&device, i);
      const std::string id = iio_channel_get_id(channel);
      const bool is_time = id == "timestamp";
      const bool readable = !iio_channel_is_output(channel) &&
                            (poll_hz_ > 0.0 ? !is_time : iio_channel_is_scan_element(channel));
      if (!readable) {
        continue;
      }
      there.push_back(id);
      const auto wanted = std::find(wanted_channels_.begin(), wanted_channels_.end(), id);
      if (!wanted_channels_.empty() && wanted == wanted_channels_.end() && !is_time) {
        iio_channel_disable(channel);
        continue;
      }
      iio_channel_enable(channel);
      channels.push_back(describe(*channel, id, is_time));
      if (!names_.empty() && wanted != wanted_channels_.end()) {
        channels.back().name = names_[static_cast<std::size_t>(wanted - wanted_channels_.begin())];
      }
    }
    for (const std::string& wanted : wanted_channels_) {
      if (std::find(there.begin(), there.end(), wanted) == there.end()) {
        return formatted("{}: no channel '{}'; the channels are {}", name_, wanted, joined(there));
      }
    }
    if (channels_.empty()) {
      channels_ = channels;
      clock_.set_channels(channels_);
    }
    return "";
  }

  Channel describe(iio_channel& channel, const std::string& id, bool is_time) {
    IioChannel one{.channel = &channel, .is_time = is_time};
    Channel result{.name = is_time ? "timestamp_ns" : id, .unit = ""};
    if (!is_time) {
      if (iio_channel_attr_read_double(&channel, "scale", &one.scale) != 0) {
        one.scale = 1.0;
      }
      if (iio_channel_attr_read_double(&channel, "offset", &one.offset) != 0) {
        one.offset = 0.0;
      }
      for (const Unit& unit : units) {
        if (id.starts_with(unit.prefix)) {
          one.scale *= unit.factor;
          one.unit = unit.factor;
          result.unit = unit.unit;
        }
      }
    }
    read_.push_back(one);
    return result;
  }

  int refill(SampleBatch& batch, SourceReport& report) {
    const ssize_t bytes = iio_buffer_refill(buffer_.get());
    if (bytes < 0) {
      return static_cast<int>(bytes);
    }
    report.bytes = static_cast<std::size_t>(bytes);
    const double arrival_s = session_seconds();
    const std::ptrdiff_t step = iio_buffer_step(buffer_.get());
    const auto* const end = static_cast<const char*>(iio_buffer_end(buffer_.get()));
    const auto* const start = static_cast<const char*>(iio_buffer_start(buffer_.get()));
    std::vector<double> values(read_.size());
    for (std::ptrdiff_t at = 0; start + at < end; at += step) {
      for (std::size_t i = 0; i < read_.size(); ++i) {
        const auto* const first =
            static_cast<const char*>(iio_buffer_first(buffer_.get(), read_[i].channel));
        values[i] = (raw(*read_[i].channel, first + at) + read_[i].offset) * read_[i].scale;
      }
      clock_.append(values, arrival_s, batch, report);
    }
    return 0;
  }

  static double raw(const iio_channel& channel, const void* source) {
    const iio_data_format* const format = iio_channel_get_data_format(&channel);
    std::uint64_t bits = 0;
    iio_channel_convert(&channel, &bits, source);
    const unsigned length = format->length;
    if (format->is_signed && length < 64 && ((bits >> (length - 1)) & 1U) != 0) {
      bits |= ~std::uint64_t{0} << length;
    }
    return format->is_signed ? static_cast<double>(static_cast<std::int64_t>(bits))
                             : static_cast<double>(bits);
  }

  int poll(SampleBatch& batch, SourceReport& report, std::chrono::milliseconds patience) {
    const double wait_s = next_poll_s_ - session_seconds();
    if (wait_s > 0.0) {
      std::this_thread::sleep_for(
          std::min(patience, std::chrono::milliseconds(static_cast<int>(1000.0 * wait_s) + 1)));
      if (session_seconds() < next_poll_s_) {
        return 0;
      }
    }
    next_poll_s_ = std::max(next_poll_s_ + 1.0 / poll_hz_, session_seconds());
    std::vector<double> values;
    for (const IioChannel& one : read_) {
      double value = 0.0;
      int error = iio_channel_attr_read_double(one.channel, "raw", &value);
      value = (value + one.offset) * one.scale;
      if (error != 0) {
        error = iio_channel_attr_read_double(one.channel, "input", &value);
        value *= one.unit;
      }
      if (error != 0) {
        return error;
      }
      values.push_back(value);
    }
    ++report.bytes;
    clock_.append(values, session_seconds(), batch, report);
    return 0;
  }

  std::string name_;
  std::string uri_;
  std::string wanted_device_;
  std::vector<std::string> wanted_channels_;
  std::vector<std::string> names_;
  std::size_t samples_;
  double poll_hz_;
  SampleClock clock_;
  std::vector<Channel> channels_;
  std::unique_ptr<iio_context, ContextDeleter> context_;
  std::unique_ptr<iio_buffer, BufferDeleter> buffer_;
  std::vector<IioChannel> read_;
  std::string message_;
  bool was_open_ = false;
  double next_try_s_ = 0.0;
  double next_poll_s_ = 0.0;
};

}  // namespace

bool has_iio() noexcept {
  return true;
}

std::unique_ptr<Source> open_iio_source(const SourceAddress& address) {
  return std::make_unique<IioSource>(address);
}

std::vector<FoundSource> find_iio_devices() {
  std::vector<FoundSource> found;
  iio_scan_context* scan = nullptr;
  try {
    scan = iio_create_scan_context(nullptr, 0);
  } catch (const RefusedError&) {
    return found;  // without the library no device can be opened
  }
  if (scan == nullptr) {
    return found;
  }
  iio_context_info** list = nullptr;
  const ssize_t count = iio_scan_context_get_info_list(scan, &list);
  for (ssize_t i = 0; i < count; ++i) {
    found.push_back({.address = std::string("iio:") + iio_context_info_get_uri(list[i]),
                     .description = iio_context_info_get_description(list[i])});
  }
  if (count >= 0) {
    iio_context_info_list_free(list);
  }
  iio_scan_context_destroy(scan);
  return found;
}

#else

bool has_iio() noexcept {
  return false;
}

std::unique_ptr<Source> open_iio_source(const SourceAddress& address) {
  address.fail("this build lacks libiio");
}

std::vector<FoundSource> find_iio_devices() {
  return {};
}

#endif

}  // namespace axiscal
