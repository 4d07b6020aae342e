// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <thread>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/serial_port.hpp>
#include <boost/asio/write.hpp>
#include <poll.h>
#include <unistd.h>

#include "acquisition/src/byte_link.hpp"
#include "axiscal/acquisition/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

namespace asio = boost::asio;
using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds retry_after{1};
constexpr std::size_t most_bytes = 1U << 16U;

// Waits until a descriptor can be read, at most for `patience`. @return false after a timeout.
bool wait_readable(int descriptor, std::chrono::milliseconds patience) {
  pollfd one{.fd = descriptor, .events = POLLIN, .revents = 0};
  return ::poll(&one, 1, static_cast<int>(patience.count())) > 0;
}

bool would_block(const boost::system::error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again;
}

// The base class of links that reopen themselves after they were lost.
class ReopenedLink : public ByteLink {
 public:
  LinkReport read(std::string& bytes, std::chrono::milliseconds patience) final {
    if (!is_open()) {
      const Clock::time_point now = Clock::now();
      if (now < next_try_) {
        std::this_thread::sleep_for(
            std::min(patience, std::chrono::ceil<std::chrono::milliseconds>(next_try_ - now)));
        return {.state = was_open_ ? LinkState::lost : LinkState::waiting, .message = message_};
      }
      next_try_ = now + retry_after;
      message_ = open(patience);
      if (!message_.empty() || !is_open()) {
        close();
        return {.state = was_open_ ? LinkState::lost : LinkState::waiting, .message = message_};
      }
      const bool again = was_open_;
      was_open_ = true;
      return {.state = LinkState::open, .message = "", .reopened = again};
    }
    const std::size_t before = bytes.size();
    bytes.resize(before + most_bytes);
    std::size_t count = 0;
    const std::string lost = receive(bytes.data() + before, most_bytes, patience, count);
    bytes.resize(before + count);
    if (!lost.empty()) {
      close();
      message_ = lost;
      next_try_ = Clock::now() + retry_after;
      return {.state = LinkState::lost, .message = message_};
    }
    return {};
  }

 protected:
  [[nodiscard]] virtual bool is_open() const = 0;
  // Opens the link. @return the reason if it cannot be opened; otherwise empty.
  virtual std::string open(std::chrono::milliseconds patience) = 0;
  virtual void close() = 0;
  // Receives bytes. @return the reason if the link is lost; otherwise empty.
  virtual std::string receive(char* data,
                              std::size_t size,
                              std::chrono::milliseconds patience,
                              std::size_t& count) = 0;

 private:
  bool was_open_ = false;
  Clock::time_point next_try_;
  std::string message_;
};

template <typename Stream>
std::string receive_from(Stream& stream,
                         char* data,
                         std::size_t size,
                         std::chrono::milliseconds patience,
                         std::size_t& count) {
  if (!wait_readable(stream.native_handle(), patience)) {
    return "";
  }
  boost::system::error_code error;
  count = stream.read_some(asio::buffer(data, size), error);
  return error && !would_block(error) ? error.message() : "";
}

// Parses PORT (on loopback) or ADDRESS:PORT.
HostAndPort place_to_listen(SourceAddress address) {
  if (address.place.find(':') == std::string::npos) {
    address.place = "127.0.0.1:" + address.place;
  }
  return host_and_port(address);
}

template <typename Protocol>
typename Protocol::endpoint endpoint_of(asio::io_context& context,
                                        const HostAndPort& place,
                                        boost::system::error_code& error) {
  typename Protocol::resolver resolver(context);
  const auto found =
      resolver.resolve(place.host, place.port, asio::ip::resolver_base::passive, error);
  return error ? typename Protocol::endpoint{} : found.begin()->endpoint();
}

class SerialLink final : public ReopenedLink {
 public:
  explicit SerialLink(const SourceAddress& address)
      : path_(address.place),
        baud_(static_cast<unsigned>(address.number_or("baud", 115200.0, 50.0, 4e6))),
        bits_(static_cast<unsigned>(address.number_or("bits", 8.0, 5.0, 8.0))),
        parity_(address.text_or("parity", "none")),
        stop_bits_(address.number_or("stop", 1.0, 1.0, 2.0)),
        flow_(address.text_or("flow", "none")),
        port_(context_) {
    if (path_.empty()) {
      address.fail(
          "name a port, for example serial:/dev/ttyUSB0; the list of sources shows the connected "
          "devices",
          {settings::ports});
    }
    if (parity_ != "none" && parity_ != "even" && parity_ != "odd") {
      address.fail(formatted("parity={}: expected none, even or odd", parity_));
    }
    if (flow_ != "none" && flow_ != "hardware" && flow_ != "software") {
      address.fail(formatted("flow={}: expected none, hardware or software", flow_));
    }
  }

  [[nodiscard]] bool joins_midway() const override { return true; }

 protected:
  [[nodiscard]] bool is_open() const override { return port_.is_open(); }

  std::string open(std::chrono::milliseconds /*patience*/) override {
    using Port = asio::serial_port_base;
    boost::system::error_code error;
    const auto failed = [&](const std::string& what) {
      return formatted("{}: {}{}{}", path_, what, error.message(),
                       error == asio::error::access_denied
                           ? " (only members of the group dialout may open serial ports)"
                           : "");
    };
    port_.open(path_, error);
    if (error) {
      return failed("");
    }
    port_.set_option(Port::character_size(bits_), error);
    if (!error) {
      port_.set_option(Port::parity(parity_ == "even"  ? Port::parity::even
                                    : parity_ == "odd" ? Port::parity::odd
                                                       : Port::parity::none),
                       error);
    }
    if (!error) {
      port_.set_option(Port::stop_bits(stop_bits_ == 1.0   ? Port::stop_bits::one
                                       : stop_bits_ == 1.5 ? Port::stop_bits::onepointfive
                                                           : Port::stop_bits::two),
                       error);
    }
    if (!error) {
      port_.set_option(Port::flow_control(flow_ == "hardware"   ? Port::flow_control::hardware
                                          : flow_ == "software" ? Port::flow_control::software
                                                                : Port::flow_control::none),
                       error);
    }
    if (!error) {
      port_.set_option(Port::baud_rate(baud_), error);
    }
    return error ? failed(
                       "the port does not accept the serial settings (baud rate, parity, flow "
                       "control): ")
                 : "";
  }

  void close() override {
    boost::system::error_code ignored;
    port_.close(ignored);
  }

  std::string receive(char* data,
                      std::size_t size,
                      std::chrono::milliseconds patience,
                      std::size_t& count) override {
    const std::string lost = receive_from(port_, data, size, patience, count);
    return lost.empty() ? "" : formatted("{}: the device was unplugged ({})", path_, lost);
  }

 private:
  std::string path_;
  unsigned baud_;
  unsigned bits_;
  std::string parity_;
  double stop_bits_;
  std::string flow_;
  asio::io_context context_;
  asio::serial_port port_;
};

class TcpLink : public ReopenedLink {
 public:
  explicit TcpLink(const SourceAddress& address) : name_(address.place), socket_(context_) {}

  bool write(std::string_view text) override {
    if (!socket_.is_open()) {
      return false;
    }
    boost::system::error_code error;
    asio::write(socket_, asio::buffer(text.data(), text.size()), error);
    return !error;
  }

 protected:
  [[nodiscard]] bool is_open() const override { return socket_.is_open(); }

  void close() override {
    boost::system::error_code ignored;
    socket_.close(ignored);
  }

  std::string receive(char* data,
                      std::size_t size,
                      std::chrono::milliseconds patience,
                      std::size_t& count) override {
    const std::string lost = receive_from(socket_, data, size, patience, count);
    return lost.empty() ? "" : formatted("{}: the connection was closed ({})", name_, lost);
  }

  std::string name_;
  asio::io_context context_;
  asio::ip::tcp::socket socket_;
};

class TcpClientLink final : public TcpLink {
 public:
  TcpClientLink(const SourceAddress& address, const std::string& usual_port)
      : TcpLink(address), place_(host_and_port(address, usual_port)) {}

 protected:
  std::string open(std::chrono::milliseconds patience) override {
    boost::system::error_code error;
    asio::ip::tcp::resolver resolver(context_);
    const auto found = resolver.resolve(place_.host, place_.port, error);
    if (error) {
      return formatted("{}: {}", name_, error.message());
    }
    error = asio::error::timed_out;
    asio::async_connect(socket_, found,
                        [&error](const boost::system::error_code& result,
                                 const auto& /*endpoint*/) { error = result; });
    context_.restart();
    context_.run_for(std::max(patience, std::chrono::milliseconds(500)));
    if (!context_.stopped()) {  // the connection was not made in time
      close();
      context_.run();
      error = asio::error::timed_out;
    }
    if (!error) {
      socket_.non_blocking(false, error);
      socket_.set_option(asio::socket_base::keep_alive(true), error);
    }
    return error ? formatted("{}: {}", name_, error.message()) : "";
  }

 private:
  HostAndPort place_;
};

class TcpServerLink final : public TcpLink {
 public:
  explicit TcpServerLink(const SourceAddress& address)
      : TcpLink(address), acceptor_(context_), place_(place_to_listen(address)) {}

 protected:
  std::string open(std::chrono::milliseconds patience) override {
    boost::system::error_code error;
    if (!acceptor_.is_open()) {
      const auto endpoint = endpoint_of<asio::ip::tcp>(context_, place_, error);
      if (!error) {
        acceptor_.open(endpoint.protocol(), error);
        acceptor_.set_option(asio::socket_base::reuse_address(true), error);
        acceptor_.bind(endpoint, error);
        if (!error) {
          acceptor_.listen(1, error);
        }
      }
      if (error) {
        const std::string why = formatted("{}: {}", name_, error.message());
        acceptor_.close(error);
        return why;
      }
    }
    if (!wait_readable(acceptor_.native_handle(), patience)) {
      return formatted("port {}: no client has connected yet", place_.port);
    }
    acceptor_.accept(socket_, error);
    return error ? formatted("{}: {}", name_, error.message()) : "";
  }

 private:
  asio::ip::tcp::acceptor acceptor_;
  HostAndPort place_;
};

class UdpLink final : public ReopenedLink {
 public:
  explicit UdpLink(const SourceAddress& address)
      : name_(address.place), socket_(context_), place_(place_to_listen(address)) {}

  [[nodiscard]] bool has_messages() const override { return true; }

 protected:
  [[nodiscard]] bool is_open() const override { return socket_.is_open(); }

  std::string open(std::chrono::milliseconds /*patience*/) override {
    boost::system::error_code error;
    const auto endpoint = endpoint_of<asio::ip::udp>(context_, place_, error);
    if (!error) {
      socket_.open(endpoint.protocol(), error);
      if (!error) {
        // The buffer must be large enough for the datagrams that arrive during a write to the disk.
        boost::system::error_code ignored;
        socket_.set_option(asio::socket_base::receive_buffer_size(4 << 20), ignored);
        socket_.bind(endpoint, error);
      }
    }
    return error ? formatted("{}: {}", name_, error.message()) : "";
  }

  void close() override {
    boost::system::error_code ignored;
    socket_.close(ignored);
  }

  std::string receive(char* data,
                      std::size_t size,
                      std::chrono::milliseconds patience,
                      std::size_t& count) override {
    if (!wait_readable(socket_.native_handle(), patience)) {
      return "";
    }
    boost::system::error_code error;
    count = socket_.receive(asio::buffer(data, size), 0, error);
    return error && !would_block(error) ? formatted("{}: {}", name_, error.message()) : "";
  }

 private:
  std::string name_;
  asio::io_context context_;
  asio::ip::udp::socket socket_;
  HostAndPort place_;
};

class StandardInput final : public ByteLink {
 public:
  LinkReport read(std::string& bytes, std::chrono::milliseconds patience) override {
    if (!wait_readable(STDIN_FILENO, patience)) {
      return {};
    }
    const std::size_t before = bytes.size();
    bytes.resize(before + most_bytes);
    const ssize_t count = ::read(STDIN_FILENO, bytes.data() + before, most_bytes);
    bytes.resize(before + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) {
      return {.state = LinkState::ended, .message = "standard input ended"};
    }
    return {};
  }
};

}  // namespace

bool ByteLink::write(std::string_view /*text*/) {
  return false;
}

std::unique_ptr<ByteLink> open_serial(const SourceAddress& address) {
  return std::make_unique<SerialLink>(address);
}

std::unique_ptr<ByteLink> open_tcp_client(const SourceAddress& address,
                                          const std::string& usual_port) {
  return std::make_unique<TcpClientLink>(address, usual_port);
}

std::unique_ptr<ByteLink> open_tcp_server(const SourceAddress& address) {
  return std::make_unique<TcpServerLink>(address);
}

std::unique_ptr<ByteLink> open_udp(const SourceAddress& address) {
  return std::make_unique<UdpLink>(address);
}

std::unique_ptr<ByteLink> open_standard_input() {
  return std::make_unique<StandardInput>();
}

}  // namespace axiscal
