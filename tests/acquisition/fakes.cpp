// SPDX-License-Identifier: Apache-2.0
#include "fakes.hpp"

#include <arpa/inet.h>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <netinet/in.h>
#include <stdexcept>
#include <termios.h>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/core/number_text.hpp"
#include "guided.hpp"

namespace axiscal::test {
namespace {

// Forwards the samples of a simulated source and stores a copy of each.
class Tee final : public Source {
 public:
  explicit Tee(std::vector<std::vector<double>>& rows) : source_("sim:", setup()), rows_(rows) {}

  [[nodiscard]] const std::vector<Channel>& channels() const override { return source_.channels(); }
  [[nodiscard]] const std::string& name() const override { return source_.name(); }
  [[nodiscard]] bool is_live() const override { return false; }
  void request(const DesignEntry* entry, bool warned) override { source_.request(entry, warned); }

  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override {
    const std::size_t before = batch.size();
    const SourceReport report = source_.read(batch, patience);
    for (std::size_t i = before; i < batch.size(); ++i) {
      rows_.emplace_back(batch.row(i).begin(), batch.row(i).end());
    }
    return report;
  }

 private:
  static SimulationSetup setup() {
    SimulationSetup setup;
    setup.rate_hz = 50.0;
    return setup;
  }

  SimulatedSource source_;
  std::vector<std::vector<double>>& rows_;
};

int listen_at(int port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(descriptor, 4) != 0) {
    throw std::runtime_error(std::string("cannot listen: ") + std::strerror(errno));
  }
  return descriptor;
}

int port_of(int descriptor) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

}  // namespace

std::string Recording::csv() const {
  std::string text = "time,x,y,z\n";
  for (const std::vector<double>& row : rows) {
    text += number_text(row[0]) + "," + number_text(row[1]) + "," + number_text(row[2]) + "," +
            number_text(row[3]) + "\n";
  }
  return text;
}

std::string Recording::csv_without_time() const {
  std::string text = "x,y,z\n";
  for (const std::vector<double>& row : rows) {
    text += number_text(row[1]) + "," + number_text(row[2]) + "," + number_text(row[3]) + "\n";
  }
  return text;
}

Recording record_session(unsigned seed) {
  Recording recording;
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("recording.journal"));
  Session session(guided_setup(seed), journal);
  std::vector<std::unique_ptr<Source>> sources;
  sources.push_back(std::make_unique<Tee>(recording.rows));
  SampleFeed feed(std::move(sources));
  run_session(session, feed, {}, true);
  return recording;
}

Descriptor::~Descriptor() {
  close();
}

void Descriptor::close() {
  if (number_ >= 0) {
    ::close(number_);
    number_ = -1;
  }
}

bool Descriptor::write(const std::string& text) const {
  std::size_t written = 0;
  while (written < text.size()) {
    // MSG_NOSIGNAL works for sockets only. A pseudo-terminal needs write().
    ssize_t count = ::send(number_, text.data() + written, text.size() - written, MSG_NOSIGNAL);
    if (count < 0 && errno == ENOTSOCK) {
      count = ::write(number_, text.data() + written, text.size() - written);
    }
    if (count <= 0) {
      return false;
    }
    written += static_cast<std::size_t>(count);
  }
  return true;
}

std::string Descriptor::line() {
  for (;;) {
    const std::size_t end = held_.find('\n');
    if (end != std::string::npos) {
      std::string result = held_.substr(0, end);
      held_.erase(0, end + 1);
      if (!result.empty() && result.back() == '\r') {
        result.pop_back();
      }
      return result.empty() ? line() : result;
    }
    char buffer[512];
    const ssize_t count = ::read(number_, buffer, sizeof buffer);
    if (count <= 0) {
      return "";
    }
    held_.append(buffer, static_cast<std::size_t>(count));
  }
}

FakeServer::FakeServer(std::function<void(Descriptor&, int)> talk, int port)
    : talk_(std::move(talk)), listening_(listen_at(port)), port_(port_of(listening_.number())) {
  thread_ = std::thread([this] {
    for (int number = 0; !stopping_;) {
      pollfd one{.fd = listening_.number(), .events = POLLIN, .revents = 0};
      constexpr int patience_ms = 50;
      if (::poll(&one, 1, patience_ms) > 0 && !stopping_) {
        const int accepted = ::accept(listening_.number(), nullptr, nullptr);
        talks_.emplace_back([this, accepted, number] {
          Descriptor connection(accepted);
          talk_(connection, number);
        });
        ++number;
      }
    }
  });
}

FakeServer::~FakeServer() {
  stopping_ = true;
  thread_.join();
  for (std::thread& talk : talks_) {
    talk.join();
  }
}

PseudoPort::PseudoPort() : master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)), slave(-1) {
  if (master.number() < 0 || ::grantpt(master.number()) != 0 || ::unlockpt(master.number()) != 0) {
    throw std::runtime_error("no pseudo-terminal");
  }
  path = ::ptsname(master.number());
  termios settings{};
  Descriptor port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ::tcgetattr(port.number(), &settings);
  ::cfmakeraw(&settings);
  ::tcsetattr(port.number(), TCSANOW, &settings);
  new (&slave) Descriptor(std::move(port));
}

Descriptor connect_to(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  constexpr int tries = 500;
  for (int i = 0; i < tries; ++i) {
    Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
        0) {
      return socket;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  throw std::runtime_error("nobody listens");
}

int free_port() {
  const Descriptor listening(listen_at(0));
  return port_of(listening.number());
}

std::function<void(Descriptor&, int)> fake_multimeter(const std::vector<std::string>& readings,
                                                      std::vector<std::string>& commands) {
  auto next = std::make_shared<std::size_t>(0);
  return [&readings, &commands, next](Descriptor& connection, int /*number*/) {
    for (std::string line = connection.line(); !line.empty(); line = connection.line()) {
      if (line == "SYST:ERR?") {
        connection.write("+0,\"No error\"\n");
      } else if (line == "READ?") {
        if (*next == readings.size()) {
          return;
        }
        connection.write(readings[(*next)++] + "\n");
      } else {
        commands.push_back(line);
      }
    }
  };
}

std::function<void(Descriptor&, int)> fake_iiod(const Recording& recording, double scale) {
  // libiio 0.24 validates the XML, so the document type is the one that libiio writes.
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?><!DOCTYPE context [<!ELEMENT context (device | "
      "context-attribute)*><!ELEMENT context-attribute EMPTY><!ELEMENT device (channel | attribute "
      "| debug-attribute | buffer-attribute)*><!ELEMENT channel (scan-element?, "
      "attribute*)><!ELEMENT attribute EMPTY><!ELEMENT scan-element EMPTY><!ELEMENT "
      "debug-attribute EMPTY><!ELEMENT buffer-attribute EMPTY><!ATTLIST context name CDATA "
      "#REQUIRED description CDATA #IMPLIED><!ATTLIST device id CDATA #REQUIRED name CDATA "
      "#IMPLIED><!ATTLIST channel id CDATA #REQUIRED type (input|output) #REQUIRED><!ATTLIST "
      "scan-element index CDATA #REQUIRED format CDATA #REQUIRED scale CDATA #IMPLIED><!ATTLIST "
      "attribute name CDATA #REQUIRED filename CDATA #IMPLIED>]><context name=\"fake\" "
      "description=\"fake\"><device id=\"iio:device0\" name=\"adxl355\">";
  int index = 0;
  for (const char axis : {'x', 'y', 'z'}) {
    const std::string id = std::string("accel_") + axis;
    xml += "<channel id=\"" + id + "\" type=\"input\"><scan-element index=\"" +
           std::to_string(index++) + "\" format=\"le:S32/32&gt;&gt;0\" scale=\"" +
           number_text(scale) + "\"/><attribute name=\"raw\" filename=\"in_" + id +
           "_raw\"/><attribute name=\"scale\" filename=\"in_accel_scale\"/></channel>";
  }
  xml += "</device></context>";
  return [&recording, xml, scale](Descriptor& connection, int /*number*/) {
    std::size_t next = 0;
    for (std::string line = connection.line(); !line.empty(); line = connection.line()) {
      if (line.starts_with("VERSION")) {
        connection.write("0.24.fake000\n");
      } else if (line.starts_with("PRINT")) {
        connection.write(std::to_string(xml.size()) + "\n" + xml + "\n");
      } else if (line.starts_with("ZPRINT")) {
        connection.write("-22\n");
      } else if (line.starts_with("READ ")) {
        const bool is_scale = line.find("scale") != std::string::npos;
        const std::string value = number_text(scale) + std::string(1, '\0');
        connection.write(is_scale ? std::to_string(value.size()) + "\n" + value + "\n" : "-2\n");
      } else if (line.starts_with("READBUF")) {
        const std::size_t bytes =
            static_cast<std::size_t>(std::stoul(line.substr(line.rfind(' ') + 1)));
        std::string data;
        // An IIO buffer is always full. After the last row of the recording the last row is
        // repeated.
        constexpr std::size_t most_after = 2000;
        const std::size_t last = recording.rows.size() - 1;
        while (data.size() + 12 <= bytes && next < last + most_after) {
          for (std::size_t k = 1; k <= 3; ++k) {
            const double value = recording.rows[std::min(next, last)][k];
            const auto raw = static_cast<std::int32_t>(std::lround(value / scale));
            char part[4];
            std::memcpy(part, &raw, sizeof part);
            data.append(part, sizeof part);
          }
          ++next;
        }
        if (data.size() + 12 <= bytes) {
          return;
        }
        connection.write(std::to_string(data.size()) + "\n00000007\n" + data);
      } else {
        connection.write("0\n");
      }
    }
  };
}

}  // namespace axiscal::test
