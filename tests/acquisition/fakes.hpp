// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace axiscal::test {

/// The recording of a simulated session at the 12 standard design points.
struct Recording {
  std::vector<std::vector<double>> rows;  ///< time, x, y, z

  [[nodiscard]] std::string csv() const;  ///< CSV text with a header line
  [[nodiscard]] std::string csv_without_time() const;
};

/// @param seed  seed of the simulation and of the run sheet (`--seed` of the command).
[[nodiscard]] Recording record_session(unsigned seed);

/// A file descriptor that is closed in the destructor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&&) = delete;

  [[nodiscard]] int number() const { return number_; }
  /// Writes the whole text. @return false if the peer has closed the connection.
  bool write(const std::string& text) const;
  /// Reads one line without its line feed. @return an empty string at the end of the input.
  [[nodiscard]] std::string line();
  void close();

 private:
  int number_;
  std::string held_;
};

/// A server on loopback that handles each client in a separate thread.
class FakeServer {
 public:
  /// @param talk  called with each connection and its number, which counts from 0.
  /// @param port  port number; 0 takes any free port.
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

/// A pseudo-terminal that stands for a serial port. Bytes written to `master` can be read at
/// `path`.
struct PseudoPort {
  PseudoPort();
  Descriptor master;
  Descriptor slave;
  std::string path;
};

/// Connects to a port on loopback. Tries again until a server listens.
[[nodiscard]] Descriptor connect_to(int port);

/// @return a port on loopback at which no server listens.
[[nodiscard]] int free_port();

/// A multimeter that answers each READ? with the next element of `readings`.
[[nodiscard]] std::function<void(Descriptor&, int)> fake_multimeter(
    const std::vector<std::string>& readings, std::vector<std::string>& commands);

/// An IIO daemon with one accelerometer of three 32-bit channels. It sends the rows of `recording`.
[[nodiscard]] std::function<void(Descriptor&, int)> fake_iiod(const Recording& recording,
                                                              double scale);

}  // namespace axiscal::test
