// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace axiscal::test {

/// A recording of a whole session of twelve points, as a simulated person took it.
struct Recording {
  std::vector<std::vector<double>> rows;  ///< time, x, y, z

  [[nodiscard]] std::string csv() const;  ///< with its header
  [[nodiscard]] std::string csv_without_time() const;
};

/// @param seed  of the run sheet too, as `--seed` of the command.
[[nodiscard]] Recording record_session(unsigned seed);

/// A descriptor that is closed at the end.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&&) = delete;

  [[nodiscard]] int number() const { return number_; }
  /// Writes all of it. @return false where the other side has gone.
  bool write(const std::string& text) const;
  /// Reads up to the next line feed, which is left out; empty at the end.
  [[nodiscard]] std::string line();
  void close();

 private:
  int number_;
  std::string held_;
};

/// A server on loopback that talks to each client in a thread of its own.
class FakeServer {
 public:
  /// @param talk  called with each connection, and its number from 0.
  /// @param port  0: any.
  explicit FakeServer(std::function<void(Descriptor&, int)> talk, int port = 0);
  ~FakeServer();
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;

  [[nodiscard]] std::string port() const { return std::to_string(port_); }

 private:
  std::function<void(Descriptor&, int)> talk_;
  Descriptor listening_;
  int port_ = 0;
  std::atomic<bool> stopping_ = false;
  std::vector<std::thread> talks_;
  std::thread thread_;
};

/// A pair of a pseudo-terminal: what is written to one side comes out of the port.
struct PseudoPort {
  PseudoPort();
  Descriptor master;
  Descriptor slave;
  std::string path;
};

/// Connects to a port on loopback, trying until somebody listens.
[[nodiscard]] Descriptor connect_to(int port);

/// @return a port on loopback that nobody listens at.
[[nodiscard]] int free_port();

/// A multimeter that answers each READ? with the next of these lines.
[[nodiscard]] std::function<void(Descriptor&, int)> fake_multimeter(
    const std::vector<std::string>& readings, std::vector<std::string>& commands);

/// An IIO daemon with one accelerometer of three channels, 32 bits each, that streams these rows.
[[nodiscard]] std::function<void(Descriptor&, int)> fake_iiod(const Recording& recording,
                                                              double scale);

}  // namespace axiscal::test
