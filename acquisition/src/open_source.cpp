// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/open_source.hpp"

#include <algorithm>
#include <filesystem>

#include "acquisition/src/device_sources.hpp"
#include "acquisition/src/file_source.hpp"
#include "acquisition/src/stream_source.hpp"
#include "axiscal/acquisition/simulated_source.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

template <std::unique_ptr<ByteLink> (*open_link)(const SourceAddress&)>
std::unique_ptr<Source> open_stream(const SourceAddress& address) {
  return std::make_unique<StreamSource>(address, open_link(address));
}

std::unique_ptr<ByteLink> open_tcp(const SourceAddress& address) {
  return open_tcp_client(address);
}

std::unique_ptr<ByteLink> open_stdin(const SourceAddress& /*address*/) {
  return open_standard_input();
}

std::unique_ptr<Source> open_simulation(const SourceAddress& address) {
  SimulationSetup setup;
  constexpr double largest = 1e9;
  setup.seed = static_cast<std::uint64_t>(address.number_or("seed", 1.0, 0.0, largest));
  setup.noise_sd = address.number_or("noise", setup.noise_sd, 0.0, 1.0);
  setup.rate_hz = address.number_or("rate", setup.rate_hz, 1.0, 1e5);
  setup.speed =
      address.text_or("speed", "1") == "max" ? 0.0 : address.number_or("speed", 1.0, 1e-2, 1e4);
  setup.error_rate = address.number_or("error", 0.0, 0.0, 1.0);
  setup.knock_rate = address.number_or("knock", 0.0, 0.0, 1.0);
  setup.placement_sd_rad = address.number_or("placement", setup.placement_sd_rad, 0.0, 0.1);
  setup.sensitivity = address.number_or("sensitivity", 1.0, 1e-9, largest);
  if (address.find("temperature")) {
    setup.temperature = address.number_or("temperature", 20.0, -300.0, largest);
  }
  if (const std::optional<std::string> slope = address.find("slope")) {
    const std::optional<std::vector<double>> numbers = parse_numbers(*slope);
    if (!numbers || numbers->size() != 2 || std::hypot((*numbers)[0], (*numbers)[1]) > 0.3) {
      address.fail(formatted("slope={}: expected X,Y [rad] with a length of at most 0.3", *slope));
    }
    setup.slope = {(*numbers)[0], (*numbers)[1]};
  }
  return std::make_unique<SimulatedSource>(address.text, setup);
}

struct Scheme {
  SourceKind kind;
  std::unique_ptr<Source> (*open)(const SourceAddress&);
};

std::vector<std::string> with_stream_options(std::vector<std::string> own) {
  own.insert(own.end(), decoder_options().begin(), decoder_options().end());
  own.insert(own.end(), SampleClock::options().begin(), SampleClock::options().end());
  return own;
}

const std::vector<Scheme>& schemes() {
  static const std::vector<Scheme> all = {
      {{.scheme = "serial",
        .address = "serial:/dev/ttyUSB0?baud=115200",
        .help = "a serial port; options: baud, bits, parity, stop, flow",
        .options = with_stream_options({"baud", "bits", "parity", "stop", "flow"})},
       open_stream<open_serial>},
      {{.scheme = "tcp",
        .address = "tcp://HOST:PORT",
        .help = "connects to a server",
        .options = with_stream_options({})},
       open_stream<open_tcp>},
      {{.scheme = "tcp-listen",
        .address = "tcp-listen:PORT",
        .help =
            "waits for a client; accepts only clients on this machine unless an address is given",
        .options = with_stream_options({})},
       open_stream<open_tcp_server>},
      {{.scheme = "udp",
        .address = "udp:PORT",
        .help =
            "receives datagrams; accepts only senders on this machine unless an address is given",
        .options = with_stream_options({})},
       open_stream<open_udp>},
      {{.scheme = "stdin",
        .address = "-",
        .help = "standard input; to set options, write stdin:?OPTION=VALUE",
        .options = with_stream_options({})},
       open_stream<open_stdin>},
      {{.scheme = "file",
        .address = "file:LOG.csv?speed=1",
        .help = "replays a recording as fast as possible; speed=S replays it S times as fast as it "
                "was recorded",
        .options = {"speed", "names", "rate", "time"}},
       open_file_source},
      {{.scheme = "iio",
        .address = "iio:ip:HOST?device=NAME",
        .help = "Linux IIO, local (iio:local:) or on the network; poll=HZ reads without a trigger",
        .options = {"device", "channels", "names", "rate", "buffer", "poll"},
        .available = has_iio()},
       open_iio_source},
      {{.scheme = "scpi",
        .address = "scpi://HOST:5025?channels=101,102,103&names=x,y,z",
        .help = "a multimeter or scanner; options: range, nplc, resistor, setup, read",
        .options = {"channels", "names", "range", "nplc", "resistor", "setup", "read", "rate"}},
       open_scpi_source},
      {{.scheme = "mqtt",
        .address = "mqtt://HOST:1883/TOPIC?format=json",
        .help =
            "messages from a broker; options: user, password-file (or AXISCAL_MQTT_PASSWORD), qos",
        .options = with_stream_options({"user", "password-file", "qos"}),
        .available = has_mqtt()},
       open_stream<open_mqtt>},
      {{.scheme = "mqtts",
        .address = "mqtts://HOST:8883/TOPIC?format=json",
        .help = "messages from a broker, encrypted; ca=FILE replaces the system's certificates",
        .options = with_stream_options({"user", "password-file", "qos", "ca"}),
        .available = has_mqtt()},
       open_stream<open_mqtt>},
      {{.scheme = "sim",
        .address = "sim:?error=0.1&speed=10",
        .help = "a simulated instrument on a table, moved by a simulated person; options: seed, "
                "noise, rate, speed, slope, error, knock, placement, sensitivity, temperature",
        .options = {"seed", "noise", "rate", "speed", "slope", "error", "knock", "placement",
                    "sensitivity", "temperature"}},
       open_simulation},
  };
  return all;
}

void check_options(const SourceAddress& address, const SourceKind& kind) {
  const std::vector<std::string_view> known(kind.options.begin(), kind.options.end());
  for (const auto& [name, value] : address.options) {
    if (name == "password") {
      throw DomainError(
          "the address must not contain a password, because the journal stores the address: give "
          "password-file=FILE, or set AXISCAL_MQTT_PASSWORD");
    }
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      address.fail(formatted("unknown option '{}'{}", name,
                             did_you_mean(name, known, "the options are " + joined(kind.options))));
    }
  }
}

// Lists serial ports: first those with udev names, which contain maker and model, then other USB
// ports.
std::vector<FoundSource> find_serial_ports() {
  std::vector<FoundSource> found;
  std::vector<std::filesystem::path> linked;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/serial/by-id", error)) {
    linked.push_back(std::filesystem::canonical(entry.path(), error));
    found.push_back(
        {.address = "serial:" + entry.path().string(), .description = linked.back().string()});
  }
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    const std::string name = entry.path().filename().string();
    if ((name.starts_with("ttyUSB") || name.starts_with("ttyACM")) &&
        std::find(linked.begin(), linked.end(), entry.path()) == linked.end()) {
      found.push_back({.address = "serial:" + entry.path().string(), .description = "serial port"});
    }
  }
  return found;
}

}  // namespace

const std::vector<SourceKind>& source_kinds() {
  static const std::vector<SourceKind> kinds = [] {
    std::vector<SourceKind> result;
    for (const Scheme& scheme : schemes()) {
      result.push_back(scheme.kind);
    }
    return result;
  }();
  return kinds;
}

std::unique_ptr<Source> open_source(const std::string& text) {
  std::vector<std::string> names;
  for (const Scheme& scheme : schemes()) {
    names.push_back(scheme.kind.scheme);
  }
  SourceAddress address = parse_source_address(text, names);
  if (address.scheme.empty()) {
    address.scheme = address.place == "-" ? "stdin" : "file";
    const std::size_t colon = text.find("://");
    if (colon != std::string::npos) {
      const std::vector<std::string_view> views(names.begin(), names.end());
      address.fail(
          formatted("unknown kind of source '{}'{}", text.substr(0, colon),
                    did_you_mean(text.substr(0, colon), views, "the kinds are " + joined(names))));
    }
  }
  for (const Scheme& scheme : schemes()) {
    if (scheme.kind.scheme == address.scheme) {
      check_options(address, scheme.kind);
      return scheme.open(address);
    }
  }
  address.fail("unknown kind of source; the kinds are " + joined(names));
}

std::vector<FoundSource> find_sources() {
  std::vector<FoundSource> found = find_serial_ports();
  for (FoundSource& device : find_iio_devices()) {
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace axiscal
