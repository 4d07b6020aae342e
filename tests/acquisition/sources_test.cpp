// SPDX-License-Identifier: Apache-2.0
// A session of 12 points gives the same readings by each kind of source as by a file with the same
// samples.
#include <arpa/inet.h>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <netinet/in.h>
#include <optional>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "fakes.hpp"
#include "program.hpp"

namespace axiscal::test {
namespace {

const Recording& sources_recording() {
  static const Recording one = record_session(1);
  return one;
}

std::string lines_of(const std::string& format) {
  if (format == "json") {
    std::string text;
    for (const std::vector<double>& row : sources_recording().rows) {
      text += "{\"time\":" + number_text(row[0]) + ",\"acc\":{\"x\":" + number_text(row[1]) +
              ",\"y\":" + number_text(row[2]) + ",\"z\":" + number_text(row[3]) + "}}\n";
    }
    return text;
  }
  return sources_recording().csv();
}

class SourceTest : public testing::Test {
 protected:
  // Runs a session. @return the readings; each row is run, samples, x, y, z.
  std::vector<std::vector<double>> readings_from(const std::string& address,
                                                 const std::vector<std::string>& more = {},
                                                 const std::string& stdin_text = "") {
    const std::string name = folder_.path("session-" + std::to_string(count_++));
    std::vector<std::string> arguments = {
        "acquire", "--connect", address,        "--unattended",  "--plain", "--name", name,
        "--seed",  "1",         "--instrument", "accelerometer", "--field", "gravity"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::find(more.begin(), more.end(), "--unit") == more.end()) {
      arguments.insert(arguments.end(), {"--unit", "g"});
    }
    const ProgramResult result = run_axiscal(arguments, {.stdin_text = stdin_text});
    EXPECT_EQ(result.status, 0) << result.err << result.out;
    std::vector<std::vector<double>> readings;
    if (!std::filesystem::exists(name + ".csv")) {
      return readings;
    }
    const std::vector<std::vector<std::string>> cells = csv_cells(read_file(name + ".csv"));
    const auto column = [&](const std::string& header) {
      const auto found = std::find(cells[0].begin(), cells[0].end(), header);
      return static_cast<std::size_t>(found - cells[0].begin());
    };
    for (std::size_t i = 1; i < cells.size(); ++i) {
      std::vector<double> row;
      const std::vector<std::string> axes =
          more.empty() ? std::vector<std::string>{"x", "y", "z"}
                       : std::vector<std::string>{cells[0][column("samples") - 3],
                                                  cells[0][column("samples") - 2],
                                                  cells[0][column("samples") - 1]};
      for (const std::string& header :
           {std::string("run"), std::string("samples"), axes[0], axes[1], axes[2]}) {
        row.push_back(std::stod(cells[i][column(header)]));
      }
      readings.push_back(row);
    }
    return readings;
  }

  static void expect_same(const std::vector<std::vector<double>>& readings,
                          const std::vector<std::vector<double>>& expected,
                          double tolerance) {
    ASSERT_EQ(readings.size(), 12U);
    ASSERT_EQ(expected.size(), 12U);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(readings[i][0], expected[i][0]);
      EXPECT_EQ(readings[i][1], expected[i][1]) << "samples of run " << i + 1;
      for (std::size_t k = 2; k < 5; ++k) {
        EXPECT_NEAR(readings[i][k], expected[i][k], tolerance) << "run " << i + 1;
      }
    }
  }

  std::vector<std::vector<double>> from_file() {
    return readings_from("file:" + folder_.write("log.csv", sources_recording().csv()));
  }

  std::vector<std::vector<double>> from_file_by_rate() {
    return readings_from(
        "file:" + folder_.write("plain.csv", sources_recording().csv_without_time()) + "?rate=50");
  }

  ScratchFolder folder_;
  int count_ = 0;
};

constexpr double rounding = 1e-12;  // [g], between the two sources

TEST_F(SourceTest, SerialPort) {
  const PseudoPort port;
  std::thread feeder([&] { port.master.write(sources_recording().csv()); });
  expect_same(readings_from("serial:" + port.path + "?baud=230400"), from_file(), rounding);
  feeder.join();
}

TEST_F(SourceTest, TcpClient) {
  const FakeServer server(
      [](Descriptor& connection, int /*number*/) { connection.write(sources_recording().csv()); });
  expect_same(readings_from("tcp://127.0.0.1:" + server.port()), from_file(), rounding);
}

TEST_F(SourceTest, TcpServer) {
  const int port = free_port();
  std::thread feeder([&] { connect_to(port).write(sources_recording().csv()); });
  expect_same(readings_from("tcp-listen:" + std::to_string(port)), from_file(), rounding);
  feeder.join();
}

// Number of bytes that wait to be read at a UDP port of this machine; nullopt if no program listens
// at the port.
std::optional<long> waiting_at(int port) {
  std::ostringstream ending;
  ending << ':' << std::uppercase << std::hex << std::setw(4) << std::setfill('0') << port;
  for (const char* const file : {"/proc/net/udp", "/proc/net/udp6"}) {
    std::ifstream table(file);
    for (std::string line; std::getline(table, line);) {
      std::istringstream cells(line);
      std::string number, local, remote, state, queues;  // `queues` is SENT:RECEIVED, in bytes
      cells >> number >> local >> remote >> state >> queues;
      if (local.ends_with(ending.str())) {
        return std::stol(queues.substr(queues.find(':') + 1), nullptr, 16);
      }
    }
  }
  return std::nullopt;
}

// A datagram is lost if no program listens or the queue is full. So the test waits before it sends
// each one.
TEST_F(SourceTest, UdpInJsonLines) {
  if (!std::filesystem::exists("/proc/net/udp")) {
    GTEST_SKIP() << "no /proc/net/udp: whether somebody listens cannot be seen";
  }
  const int port = free_port();
  std::atomic<bool> is_over = false;
  std::thread feeder([&] {
    const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string all = lines_of("json");
    constexpr long most_waiting = 1L << 14U;
    for (std::size_t at = 0, sent = 0; at < all.size() && !is_over; ++sent) {
      while (sent % 20 == 0 && !is_over &&
             waiting_at(port).value_or(most_waiting) >= most_waiting) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      const std::size_t end = all.find('\n', at) + 1;
      ::sendto(socket.number(), all.data() + at, end - at, 0,
               reinterpret_cast<const sockaddr*>(&address), sizeof address);
      at = end;
    }
  });
  const std::vector<std::vector<double>> readings = readings_from(
      "udp:" + std::to_string(port) + "?format=json", {"--axes", "acc.x,acc.y,acc.z"});
  is_over = true;
  feeder.join();
  expect_same(readings, from_file(), rounding);
}

TEST_F(SourceTest, StandardInput) {
  expect_same(readings_from("-", {}, sources_recording().csv()), from_file(), rounding);
}

TEST_F(SourceTest, NamedFieldsByAPattern) {
  std::string text = "booting...\n";
  for (const std::vector<double>& row : sources_recording().rows) {
    text += "IMU t=" + number_text(row[0]) + " X: " + number_text(row[1]) +
            " Y: " + number_text(row[2]) + " Z: " + number_text(row[3]) + " ok\n";
  }
  expect_same(readings_from("-?pattern=t={time} X:{x} Y:{y} Z:{z} ok", {}, text), from_file(),
              rounding);
}

TEST_F(SourceTest, ScpiScannerWithAResistorForEachChannel) {
  std::vector<std::string> readings;
  for (const std::vector<double>& row : sources_recording().rows) {
    // Channels 101 and 102 have resistors of 50 and 100 ohms and channel 103 has none. The meter
    // reads voltages.
    readings.push_back(number_text(50.0 * row[1]) + "," + number_text(100.0 * row[2]) + "," +
                       number_text(row[3]));
  }
  std::vector<std::string> commands;
  std::vector<std::vector<double>> found;
  {
    const FakeServer server(fake_multimeter(readings, commands));
    found = readings_from("scpi://127.0.0.1:" + server.port() +
                          "?channels=101,102,103&names=x[g],y[g],z[g]&range=100&nplc=0.2&resistor="
                          "50,100,0&rate=50");
  }
  expect_same(found, from_file_by_rate(), rounding);
  const std::vector<std::string> setup = {"*CLS", "CONF:VOLT:DC 100,(@101,102,103)",
                                          "VOLT:DC:NPLC 0.2,(@101,102,103)",
                                          "ROUT:SCAN (@101,102,103)"};
  ASSERT_GE(commands.size(), setup.size());
  // The source may connect again after the last reading, before the session ends.
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_EQ(commands[i], setup[i % setup.size()]) << i;
  }
}

TEST_F(SourceTest, LinuxIioOnTheNetwork) {
  const std::vector<SourceKind>& kinds = source_kinds();
  if (std::none_of(kinds.begin(), kinds.end(),
                   [](const SourceKind& kind) { return kind.scheme == "iio" && kind.available; })) {
    GTEST_SKIP() << "built without libiio";
  }
  constexpr double scale = 1e-9;
  const FakeServer server(fake_iiod(sources_recording(), scale));
  const std::vector<std::vector<double>> found =
      readings_from("iio:ip:127.0.0.1:" + server.port() +
                        "?device=adxl355&channels=accel_x,accel_y,accel_z&names=x,y,z&rate=50",
                    {"--unit", "g"});
  expect_same(found, from_file_by_rate(), scale);
}

TEST_F(SourceTest, MqttBroker) {
  const std::vector<SourceKind>& kinds = source_kinds();
  if (std::none_of(kinds.begin(), kinds.end(), [](const SourceKind& kind) {
        return kind.scheme == "mqtt" && kind.available;
      })) {
    GTEST_SKIP() << "built without libmosquitto";
  }
  if (std::system("command -v mosquitto mosquitto_pub > /dev/null") != 0 &&
      !std::filesystem::exists("/usr/sbin/mosquitto")) {
    GTEST_SKIP() << "no mosquitto here";
  }
  const std::string port = std::to_string(free_port());
  const pid_t broker = ::fork();
  if (broker == 0) {
    const std::string config = folder_.write(
        "mosquitto.conf", "listener " + port +
                              " 127.0.0.1\nallow_anonymous true\n"
                              "max_queued_messages 0\nmax_inflight_messages 0\nlog_type none\n");
    ::setenv("PATH", "/usr/sbin:/usr/bin:/bin", 1);
    ::execlp("mosquitto", "mosquitto", "-c", config.c_str(), nullptr);
    ::_exit(127);
  }
  const std::string lines = folder_.write("lines.txt", lines_of("json"));
  std::thread feeder([&] {
    // Waits until the session has subscribed, because the broker does not store messages for later
    // subscribers.
    const std::string publish = "mosquitto_pub -h 127.0.0.1 -p " + port + " -t lab/acc -q 1 ";
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    static_cast<void>(std::system((publish + "-l < " + lines + " 2> /dev/null").c_str()));
  });
  expect_same(readings_from("mqtt://127.0.0.1:" + port + "/lab/acc?format=json",
                            {"--axes", "acc.x,acc.y,acc.z"}),
              from_file(), rounding);
  feeder.join();
  ::kill(broker, SIGTERM);
  ::waitpid(broker, nullptr, 0);
}

// Two recordings: readings that start at `begin`, and temperatures that start at another time.
class TwoRecordings : public SourceTest {
 protected:
  ProgramResult acquire(double begin,
                        double temperatures_begin,
                        const std::string& speed = "",
                        double clocks_differ_by = 0.0) {
    std::string readings = "time,x,y,z\n";
    for (const std::vector<double>& row : sources_recording().rows) {
      readings += number_text(begin + row[0]) + "," + number_text(row[1]) + "," +
                  number_text(row[2]) + "," + number_text(row[3]) + "\n";
    }
    std::string temperatures = "time,temperature\n";
    for (double t = temperatures_begin; t < begin + sources_recording().rows.back()[0] + 5.0;
         t += 0.5) {
      temperatures +=
          number_text(t + clocks_differ_by) + "," + number_text(20.0 + 0.01 * (t - begin)) + "\n";
    }
    name_ = folder_.path("two" + std::to_string(++count_));
    return run_axiscal({"acquire", "--connect",
                        "file:" + folder_.write("log.csv", readings) + speed, "--connect",
                        "file:" + folder_.write("temperature.csv", temperatures) + speed,
                        "--unattended", "--plain", "--name", name_, "--seed", "1", "--instrument",
                        "accelerometer", "--field", "gravity", "--unit", "g"});
  }

  // Expects in each reading the temperature at the time of the reading.
  void expect_temperatures(double begin) {
    const std::vector<std::vector<std::string>> cells = csv_cells(read_file(name_ + ".csv"));
    const auto column = [&](const std::string& header) {
      return static_cast<std::size_t>(std::find(cells[0].begin(), cells[0].end(), header) -
                                      cells[0].begin());
    };
    ASSERT_EQ(cells.size(), 13U);
    for (std::size_t i = 1; i < cells.size(); ++i) {
      const double middle = std::stod(cells[i].at(column("time"))) - begin;
      EXPECT_NEAR(std::stod(cells[i].at(column("temperature"))), 20.0 + 0.01 * middle, 1e-3);
    }
  }

 private:
  std::string name_;
  int count_ = 0;
};

TEST_F(TwoRecordings, GoTogetherByTheirOwnTimes) {
  struct Case {
    double begin;
    double earlier;
    std::string speed;
  };
  constexpr double utc = 1782028800.0;
  for (const Case& one : {Case{0.0, 5.0, ""}, Case{5000.0, 5.0, ""}, Case{utc, 5.0, ""},
                          Case{utc, 4.0 * 3600.0, ""}, Case{utc, 5.0, "?speed=40"}}) {
    SCOPED_TRACE(number_text(one.begin) + " " + number_text(one.earlier) + one.speed);
    const ProgramResult result = acquire(one.begin, one.begin - one.earlier, one.speed);
    ASSERT_EQ(result.status, 0) << result.err;
    expect_temperatures(one.begin);
  }
}

TEST_F(TwoRecordings, OfTwoClocksAreSaidToBeApart) {
  const ProgramResult result = acquire(0.0, -5.0);
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(result.out.find("do the clocks agree"), std::string::npos);
  const ProgramResult apart = acquire(5000.0, 4995.0, "", -1000.0);
  EXPECT_NE(apart.out.find("do the clocks agree"), std::string::npos) << apart.out;
}

TEST(OpenSource, SaysWhatIsWrongWithAnAddress) {
  const auto complaint = [](const std::string& address) -> std::string {
    try {
      static_cast<void>(open_source(address));
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(complaint("serial:/dev/ttyS0?buad=9600").find("did you mean 'baud'"),
            std::string::npos);
  EXPECT_NE(complaint("serial:/dev/ttyS0?baud=fast").find("baud=fast: expected a number"),
            std::string::npos);
  EXPECT_NE(complaint("serail:///dev/ttyS0").find("serial"), std::string::npos);
  EXPECT_NE(complaint("tcp://host").find("expected HOST:PORT"), std::string::npos);
  EXPECT_NE(complaint("mqtt://host:1883").find("TOPIC"), std::string::npos);
  EXPECT_NE(complaint("/nowhere/log.csv").find("/nowhere/log.csv"), std::string::npos);
}

}  // namespace
}  // namespace axiscal::test
