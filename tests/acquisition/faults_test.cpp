// SPDX-License-Identifier: Apache-2.0
// Faults during a session: lost connections, bad lines, wrong clocks, full disks, kills.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <numeric>
#include <set>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "allocations.hpp"
#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/positioner/mount.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "fakes.hpp"
#include "program.hpp"

namespace axiscal::test {
namespace {

const Recording& recording() {
  static const Recording one = record_session(1);
  return one;
}

std::vector<std::string> lines() {
  std::vector<std::string> result;
  const std::string text = recording().csv();
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at) + 1;
    result.push_back(text.substr(at, end - at));
    at = end;
  }
  return result;
}

class FaultTest : public testing::Test {
 protected:
  ProgramResult session(const std::string& address, const std::string& stdin_text = "") {
    return run_axiscal(
        {"acquire", "--connect", address, "--unattended", "--plain", "--name", name_, "--seed", "1",
         "--instrument", "accelerometer", "--field", "gravity", "--unit", "g"},
        {.stdin_text = stdin_text});
  }

  // Starts a session and quits it at once. The session leaves a journal.
  ProgramResult quit_session() const {
    return run_axiscal(
        {"acquire", "--connect", "sim:?speed=400&rate=50", "--plain", "--name", name_},
        {.stdin_text = "quit\n"});
  }

  // The values of x, y and z of the 12 readings, reading by reading: 36 values.
  std::vector<double> readings() const {
    std::vector<double> result;
    const std::vector<std::vector<std::string>> cells = csv_cells(read_file(name_ + ".csv"));
    for (std::size_t i = 1; i < cells.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t first = static_cast<std::size_t>(
            std::find(cells[0].begin(), cells[0].end(), "x") - cells[0].begin());
        result.push_back(std::stod(cells[i][first + k]));
      }
    }
    return result;
  }

  std::vector<double> good_readings() {
    const std::string kept = std::exchange(name_, folder_.path("good"));
    EXPECT_EQ(session("file:" + folder_.write("log.csv", recording().csv())).status, 0);
    std::vector<double> result = readings();
    name_ = kept;
    return result;
  }

  static void expect_near(const std::vector<double>& found,
                          const std::vector<double>& expected,
                          double tolerance) {
    ASSERT_EQ(found.size(), 36U);
    ASSERT_EQ(expected.size(), 36U);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i], expected[i], tolerance) << "run " << i / 3 + 1;
    }
  }

  ScratchFolder folder_;
  std::string name_ = folder_.path("session");
};

TEST_F(FaultTest, TheConnectionIsLostAtEveryStage) {
  // Each connection except the last ends in the middle of a line, and the next one sends the rest
  // of that line.
  const std::string all = recording().csv();
  constexpr std::size_t parts = 7;
  const FakeServer server([&](Descriptor& connection, int number) {
    const auto part = static_cast<std::size_t>(number);
    const std::size_t from = part * all.size() / parts;
    const std::size_t to = std::min((part + 1) * all.size() / parts, all.size());
    if (part < parts) {
      connection.write(all.substr(from, to - from));
    }
  });
  const ProgramResult result = session("tcp://127.0.0.1:" + server.port());
  ASSERT_EQ(result.status, 0) << result.err << result.out;
  EXPECT_NE(result.out.find("closed"), std::string::npos);
  // Some readings lack one or two samples. The change is within the noise of a mean of 50 samples.
  expect_near(readings(), good_readings(), 1e-4);
}

TEST_F(FaultTest, TheSerialPortIsPulledAndComesBack) {
  const std::string link = folder_.path("ttyUSB0");
  auto port = std::make_unique<PseudoPort>();
  std::filesystem::create_symlink(port->path, link);
  std::thread feeder([&] {
    const std::vector<std::string> all = lines();
    const std::size_t middle = all.size() / 2;
    for (std::size_t i = 0; i < middle; ++i) {
      port->master.write(all[i]);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    std::filesystem::remove(link);
    port = std::make_unique<PseudoPort>();  // closes the old pseudo-terminal
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    std::filesystem::create_symlink(port->path, link);
    port->master.write("3.25,");  // the end of a line whose start was lost
    port->master.write("0.5\n");
    for (std::size_t i = middle; i < all.size(); ++i) {
      port->master.write(all[i]);
    }
  });
  const ProgramResult result = session("serial:" + link);
  feeder.join();
  ASSERT_EQ(result.status, 0) << result.err << result.out;
  EXPECT_NE(result.out.find("unplugged"), std::string::npos);
  expect_near(readings(), good_readings(), 1e-4);
}

TEST_F(FaultTest, HalfLinesAndGarbageAreLeftOut) {
  RandomStream random(7);
  std::string text;
  std::size_t number = 0;
  for (const std::string& line : lines()) {
    if (++number > 3 && random.uniform() < 0.02) {
      text += line.substr(0, line.size() / 2) + "\n";
    }
    if (number > 3 && random.uniform() < 0.01) {
      for (std::size_t i = 0; i < random.index(3000); ++i) {
        text += static_cast<char>(128 + random.index(128));
      }
      text += "\n";
    }
    text += line;
  }
  const ProgramResult result = session("-", text);
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.out.find("invalid lines or frames"), std::string::npos);
  expect_near(readings(), good_readings(), 1e-12);
}

TEST_F(FaultTest, DuplicatesAndSetClocksChangeNothing) {
  std::string text = "time,x,y,z\n";
  double offset = 1000.0;
  std::size_t number = 0;
  for (const std::vector<double>& row : recording().rows) {
    ++number;
    offset += number == 700 ? 3600.0 : number == 1500 ? -90000.0 : 0.0;
    const std::string line = number_text(row[0] + offset) + "," + number_text(row[1]) + "," +
                             number_text(row[2]) + "," + number_text(row[3]) + "\n";
    text += line;
    if (number % 10 == 0) {
      text += line;
    }
  }
  const ProgramResult result = session("-", text);
  ASSERT_EQ(result.status, 0) << result.err;
  expect_near(readings(), good_readings(), 1e-12);
}

// 600,000 samples of six channels arrive as fast as possible. No sample is lost, and the memory
// does not grow.
TEST(Feed, LosesNoSampleOfSixHundredThousand) {
  constexpr int samples = 600000;
  const FakeServer server([](Descriptor& connection, int number) {
    if (number > 0) {
      return;
    }
    std::string block = "time,ax,ay,az,gx,gy,gz\n";
    for (int i = 0; i < samples; ++i) {
      const std::string n = std::to_string(i);
      block += number_text(1e-4 * i) + "," + n + ",2,3,4,5,6\n";
      if (block.size() > 60000) {
        connection.write(block);
        block.clear();
      }
    }
    connection.write(block);
  });
  std::vector<std::unique_ptr<Source>> sources;
  sources.push_back(open_source("tcp://127.0.0.1:" + server.port()));
  SampleFeed feed(std::move(sources));
  SampleBatch batch;
  double next = 0.0;
  long before = 0;
  while (next < samples) {
    batch.clear();
    feed.read(batch, std::chrono::milliseconds(100));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      ASSERT_EQ(batch.row(i)[1], next);
      next += 1.0;
    }
    if (before == 0 && next > samples / 10.0) {
      rusage usage{};
      ::getrusage(RUSAGE_SELF, &usage);
      before = usage.ru_maxrss;
    }
  }
  rusage after{};
  ::getrusage(RUSAGE_SELF, &after);
  constexpr long most_growth_kib = 64 * 1024;  // several times the limit of the queue
  if (!under_address_sanitizer) {
    EXPECT_LT(after.ru_maxrss - before, most_growth_kib);
  }
  EXPECT_EQ(feed.counts().samples, static_cast<std::size_t>(samples));
  EXPECT_EQ(feed.counts().defects, 0U);
}

// A program whose output is read until it ends or until kill().
class Victim {
 public:
  explicit Victim(const std::vector<std::string>& arguments, rlim_t file_limit = RLIM_INFINITY) {
    int pipe_ends[2];
    if (::pipe2(pipe_ends, O_CLOEXEC) != 0) {
      throw std::runtime_error("no pipe");
    }
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(pipe_ends[1], STDOUT_FILENO);
      const int nothing = ::open("/dev/null", O_RDWR);
      ::dup2(nothing, STDIN_FILENO);
      ::dup2(nothing, STDERR_FILENO);
      const rlimit limit{.rlim_cur = file_limit, .rlim_max = RLIM_INFINITY};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      const std::string command = command_path();
      std::vector<char*> list = {const_cast<char*>(command.c_str())};
      for (const std::string& argument : arguments) {
        list.push_back(const_cast<char*>(argument.c_str()));
      }
      list.push_back(nullptr);
      ::execv(command.c_str(), list.data());
      ::_exit(127);
    }
    ::close(pipe_ends[1]);
    output_ = pipe_ends[0];
  }

  ~Victim() {
    kill();
    ::close(output_);
  }

  // Reads until the output contains `until`, `patience` has passed, or the program has ended.
  // @return true if the output contains `until`.
  bool read(std::chrono::microseconds patience, const std::string& until = "\x01") {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (text.find(until) == std::string::npos) {
      const auto left = std::chrono::duration_cast<std::chrono::microseconds>(
          end - std::chrono::steady_clock::now());
      if (left.count() <= 0) {
        return false;
      }
      pollfd one{.fd = output_, .events = POLLIN, .revents = 0};
      const timespec time{.tv_sec = left.count() / 1000000,
                          .tv_nsec = left.count() % 1000000 * 1000};
      if (::ppoll(&one, 1, &time, nullptr) > 0 && !take()) {
        return false;
      }
    }
    return true;
  }

  // Sends SIGKILL. Output that was written before is then in `text`.
  void kill() {
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, &status, 0);
      process_ = -1;
      while (take()) {
      }
    }
  }

  std::string text;
  int status = 0;

 private:
  bool take() {
    char buffer[4096];
    const ssize_t count = ::read(output_, buffer, sizeof buffer);
    text.append(buffer, static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return count > 0;
  }

  pid_t process_ = -1;
  int output_ = -1;
};

// Numbers of the runs that the session's JSON output reports as captured.
std::vector<int> shown_runs(const std::string& text) {
  std::vector<int> runs;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) {
      break;
    }
    const nlohmann::json line = nlohmann::json::parse(text.substr(at, end - at), nullptr, false);
    if (line.is_object() && line.value("event", "") == "captured") {
      runs.push_back(line["run"]);
    }
    at = end + 1;
  }
  return runs;
}

std::vector<int> stored_runs(const std::string& journal) {
  std::vector<int> runs;
  const std::string text = read_file(journal);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const nlohmann::json line = nlohmann::json::parse(text.substr(at, end - at), nullptr, false);
    if (line.is_object() && line.value("entry", "") == "captured") {
      runs.push_back(line["run"]);
    }
    at = end + 1;
  }
  return runs;
}

// The environment variable AXISCAL_KILLS sets the number of kills (default 20).
TEST_F(FaultTest, KilledAtAnyMomentEveryReadingThatWasShownIsThere) {
  const char* const asked = std::getenv("AXISCAL_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 20;
  RandomStream random(11);
  const std::string journal = name_ + ".journal";
  std::set<int> shown;
  int killed = 0;
  int sessions = 0;
  std::vector<std::string> arguments;
  while (killed < kills) {
    if (!std::filesystem::exists(journal)) {
      shown.clear();
      ++sessions;
      arguments = {
          "acquire",      "--connect", "sim:?speed=400&rate=50&seed=" + std::to_string(sessions),
          "--unattended", "--json",    "--name",
          name_,          "--raw"};
    } else {
      arguments = {"acquire", "--resume", journal, "--unattended", "--json"};
    }
    Victim victim(arguments);
    victim.read(std::chrono::microseconds(5000 + random.index(60000)));
    victim.kill();
    ++killed;
    for (const int run : shown_runs(victim.text)) {
      EXPECT_TRUE(shown.insert(run).second) << "run " << run << " was shown twice";
    }
    if (!std::filesystem::exists(journal)) {
      EXPECT_TRUE(shown.empty());
      continue;
    }
    const std::vector<int> stored = stored_runs(journal);
    const std::set<int> unique(stored.begin(), stored.end());
    EXPECT_EQ(unique.size(), stored.size()) << "occurs twice";
    EXPECT_TRUE(std::includes(unique.begin(), unique.end(), shown.begin(), shown.end()))
        << "a reading that was shown as captured is not there";
    shown = unique;
    if (stored.size() == 12) {
      std::filesystem::remove(journal);
    }
  }
  // The last session is resumed and finished.
  if (std::filesystem::exists(journal)) {
    const ProgramResult result =
        run_axiscal({"acquire", "--resume", journal, "--unattended", "--json"});
    if (read_file(journal).find('\n') != std::string::npos) {
      EXPECT_EQ(result.status, 0) << result.err;
      EXPECT_EQ(readings().size(), 36U);
    }
  }
}

// Two instruments in an H-shaped frame. Each has its own port and its own clock. A simulated person
// lays the cube as the session instructs.
class TwoPorts {
 public:
  TwoPorts() {
    const std::vector<Mount> mounts = h_shaped_mounts("L", "R");
    for (std::size_t i = 0; i < 2; ++i) {
      truths[i] = {.bias = 0.02 * random_.normals<3>(), .sensitivity = Eigen::Matrix3d::Identity()};
      for (double& entry : truths[i].sensitivity.reshaped()) {
        entry += 0.01 * random_.normal();
      }
      mounts_[i] = mounts[i].rotation_sensor_from_positioner;
    }
    thread_ = std::thread([this] { play(); });
  }
  ~TwoPorts() {
    over_ = true;
    thread_.join();
  }
  TwoPorts(const TwoPorts&) = delete;
  TwoPorts& operator=(const TwoPorts&) = delete;

  [[nodiscard]] std::vector<std::string> addresses() const {
    return {"serial:" + ports_[0].path + "?names=t,L.x,L.y,L.z&time=t",
            "serial:" + ports_[1].path + "?names=t,R.x,R.y,R.z&time=t"};
  }

  // Takes the pose of the last "ask" event in the output as the next pose of the cube.
  void follow(const std::string& output) {
    const std::size_t at = output.rfind("{\"event\":\"ask\"");
    const std::size_t end = output.find('\n', std::min(at, output.size()));
    if (at != std::string::npos && end != std::string::npos) {
      const nlohmann::json ask = nlohmann::json::parse(output.substr(at, end - at));
      const DesignPoint wanted(*parse_face(ask["rest"].get<std::string>()),
                               *parse_face(ask["fence"].get<std::string>()));
      const std::lock_guard<std::mutex> lock(mutex_);
      wanted_ = wanted;
    }
  }

  std::array<LinearResponse, 2> truths;

 private:
  void play() {
    constexpr double rate_hz = 50.0;
    constexpr double speed = 15.0;  // factor over real time
    const Eigen::Vector3d up = Eigen::Vector3d(0.003, -0.002, 1.0).normalized();
    std::optional<DesignPoint> lies;
    int shaking = 0;
    for (int i = 0; !over_; ++i) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (wanted_ && wanted_ != lies) {
          lies = wanted_;
          shaking = 60;
        }
      }
      const DesignPoint point = lies.value_or(DesignPoint(Face::minus_z, Face::plus_y));
      const Eigen::Vector3d in_cube =
          Positioner().rotation_table_from_positioner(point).transpose() * up +
          (shaking-- > 0 ? 0.2 : 0.0) * random_.normals<3>();
      for (std::size_t s = 0; s < 2; ++s) {
        // The clocks start at different times. One runs 30 ppm fast, the other 40 ppm slow.
        const double clock_s = (s == 0 ? 1000.0 : 5.0) + i / rate_hz * (s == 0 ? 1.00003 : 0.99996);
        std::string line = number_text(clock_s, 12);
        const Eigen::VectorXd v = truths[s].at(mounts_[s] * in_cube);
        for (const double value : v) {
          line += "," + number_text(value + 1e-4 * random_.normal(), 9);
        }
        ports_[s].master.write(line + "\n");
      }
      std::this_thread::sleep_for(std::chrono::duration<double>(1.0 / (rate_hz * speed)));
    }
  }

  std::array<PseudoPort, 2> ports_;
  std::array<Eigen::Matrix3d, 2> mounts_;
  RandomStream random_{17};
  std::mutex mutex_;
  std::optional<DesignPoint> wanted_;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

TEST_F(FaultTest, TwoInstrumentsOfAnAssemblyAreKilledAndResumed) {
  const std::string journal = name_ + ".journal";
  std::vector<std::string> arguments = {"acquire",
                                        "--assembly",
                                        "h",
                                        "--instrument",
                                        "accelerometer",
                                        "--unit",
                                        "g",
                                        "--unattended",
                                        "--json",
                                        "--dwell",
                                        "1",
                                        "--name",
                                        name_,
                                        "--record",
                                        name_ + "-cal-{slot}.json"};
  std::array<LinearResponse, 2> truths;
  std::vector<int> shown;
  for (const bool first : {true, false}) {
    TwoPorts ports;  // the same seed gives the same instruments
    truths = ports.truths;
    std::vector<std::string> all =
        first ? arguments : std::vector<std::string>{"acquire",
                                                     "--resume",
                                                     journal,
                                                     "--unattended",
                                                     "--json",
                                                     "--record",
                                                     name_ + "-cal-{slot}.json"};
    for (const std::string& address : ports.addresses()) {
      all.insert(all.end(), {"--connect", address});
    }
    Victim session(all);
    const std::string until = first ? "run 5:" : "\"event\":\"files\"";
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!session.read(std::chrono::milliseconds(20), until) &&
           std::chrono::steady_clock::now() < patience) {
      ports.follow(session.text);
    }
    ASSERT_NE(session.text.find(until), std::string::npos) << session.text.substr(
        session.text.size() - std::min<std::size_t>(session.text.size(), 3000));
    session.read(std::chrono::milliseconds(first ? 0 : 1500), "no such text");
    session.kill();
    for (const int run : shown_runs(session.text)) {
      shown.push_back(run);
    }
    EXPECT_EQ(stored_runs(journal), shown) << "nothing is lost";
  }
  EXPECT_EQ(shown.size(), 12U);
  for (std::size_t s = 0; s < 2; ++s) {
    const Calibration found = read_calibration(name_ + (s == 0 ? "-cal-L.json" : "-cal-R.json"));
    EXPECT_EQ(found.provenance.slot, s == 0 ? "L" : "R");
    EXPECT_LT((found.sensor.response.sensitivity - truths[s].sensitivity).cwiseAbs().maxCoeff(),
              2e-4);
    EXPECT_EQ(found.fit.slot_alignments.size(), 1U);
  }
}

TEST_F(FaultTest, AFullDiskIsSaidAndTheSessionGoesOnLater) {
  constexpr rlim_t room = 3000;  // bytes: room for the journal's header and two or three readings
  Victim victim(
      {"acquire", "--connect", "sim:?speed=400&rate=50", "--unattended", "--json", "--name", name_},
      room);
  ASSERT_TRUE(victim.read(std::chrono::seconds(10), "is not stored yet")) << victim.text;
  victim.kill();
  const std::vector<int> shown = shown_runs(victim.text);
  EXPECT_FALSE(shown.empty());
  EXPECT_EQ(stored_runs(name_ + ".journal"), shown);
  const ProgramResult result = run_axiscal({"acquire", "--resume", name_ + ".journal", "--connect",
                                            "sim:?speed=max&rate=50", "--unattended", "--plain"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(readings().size(), 36U);
}

TEST_F(FaultTest, AQuitSessionIsResumedByItsJournalAlone) {
  const ProgramResult first = quit_session();
  EXPECT_EQ(first.status, 1);
  EXPECT_NE(first.err.find("--resume " + name_ + ".journal"), std::string::npos) << first.err;
  const ProgramResult again =
      run_axiscal({"acquire", "--connect", "sim:", "--name", name_, "--unattended"});
  EXPECT_EQ(again.status, 4) << "the journal is not overwritten";
  EXPECT_NE(again.err.find("--resume"), std::string::npos);
  const ProgramResult second =
      run_axiscal({"acquire", "--resume", name_ + ".journal", "--unattended", "--plain"});
  EXPECT_EQ(second.status, 0) << second.err;
  const nlohmann::json record = read_json(name_ + ".json");
  EXPECT_EQ(record["inputs"][0]["path"], name_ + ".journal");
  EXPECT_EQ(record["inputs"][0]["sha256"].get<std::string>().size(), 64U);
}

// Without this error the record would silently have a frame that the user did not choose.
TEST_F(FaultTest, ASlotThatThePositionerLacksIsRefused) {
  const std::string cube = folder_.write("cube.json", run_axiscal({"template", "positioner"}).out);
  const ProgramResult wrong = run_axiscal({"acquire", "--connect", "sim:", "--positioner", cube,
                                           "--slot", "right", "--unattended", "--name", name_});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("does not have a slot 'right'; its slots are left"), std::string::npos)
      << wrong.err;
  EXPECT_FALSE(std::filesystem::exists(name_ + ".journal"));
}

// A journal may come from another person, so its output paths are ignored.
TEST_F(FaultTest, AJournalWritesNoFilesElsewhere) {
  const std::string victim = folder_.write("victim.txt", "precious");
  const ProgramResult first =
      run_axiscal({"acquire", "--connect", "sim:?speed=50&rate=50", "--plain", "--name", name_,
                   "-o", victim, "--record", victim + "2", "--report", victim + "3.html"},
                  {.stdin_text = "quit\n"});
  EXPECT_EQ(first.status, 1) << first.err;
  const ProgramResult second =
      run_axiscal({"acquire", "--resume", name_ + ".journal", "--unattended", "--plain"});
  EXPECT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(read_file(victim), "precious");
  EXPECT_FALSE(std::filesystem::exists(victim + "2"));
  EXPECT_EQ(readings().size(), 36U) << "they are beside the journal";
}

// Opening an address can control an instrument, so an address from a journal is opened only if the
// user names it.
TEST_F(FaultTest, AStrangersJournalDrivesNoInstrument) {
  ASSERT_EQ(quit_session().status, 1);
  std::string journal = read_file(name_ + ".journal");
  const std::string address = "scpi://127.0.0.1:9?channels=101,102,103&setup=OUTP%20ON";
  journal.replace(journal.find("sim:?speed=400&rate=50"), 22, address);
  std::ofstream(name_ + ".journal") << journal;
  const ProgramResult refused =
      run_axiscal({"acquire", "--resume", name_ + ".journal", "--unattended", "--plain"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("  " + address), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--connect '" + address + "'"), std::string::npos) << refused.err;
  EXPECT_EQ(read_file(name_ + ".journal"), journal) << "it is as it was";
}

TEST_F(FaultTest, APasswordStandsInNoAddress) {
  const ProgramResult refused =
      run_axiscal({"acquire", "--connect", "mqtt://127.0.0.1:9/t?user=me&password=secret",
                   "--instrument", "accelerometer", "--unattended", "--plain", "--name", name_});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("AXISCAL_MQTT_PASSWORD"), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find("secret"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(name_ + ".journal"));
  const std::string open_to_all = folder_.write("password", "secret\n");
  std::filesystem::permissions(open_to_all, std::filesystem::perms(0644));
  const ProgramResult readable = run_axiscal(
      {"acquire", "--connect", "mqtt://127.0.0.1:9/t?user=me&password-file=" + open_to_all,
       "--instrument", "accelerometer", "--unattended", "--plain", "--name", name_});
  EXPECT_EQ(readable.status, 2);
  EXPECT_NE(readable.err.find("chmod 600"), std::string::npos) << readable.err;
}

TEST_F(FaultTest, AJournalIsItsOwnersAlone) {
  ASSERT_EQ(quit_session().status, 1);
  EXPECT_EQ(std::filesystem::status(name_ + ".journal").permissions(),
            std::filesystem::perms(0600));
}

// The reader of the session's output exits. The session continues to its end.
TEST_F(FaultTest, ASessionWhoseReaderHasGoneEndsWithItsReadings) {
  const std::string command = "set -o pipefail; '" + command_path() +
                              "' acquire --connect 'sim:?speed=max&rate=50' --instrument "
                              "accelerometer --unattended --plain --name '" +
                              name_ + "' 2>/dev/null | head -n 1 >/dev/null";
  const std::string quoted = "bash -c \"" + command + "\"";
  EXPECT_EQ(WEXITSTATUS(std::system(quoted.c_str())), 0);
  EXPECT_EQ(readings().size(), 36U);
}

// Standard input is closed, so a question cannot be answered. The session ends, and it can be
// resumed.
TEST_F(FaultTest, AQuestionToNobodyEndsTheSession) {
  const std::string command =
      "'" + command_path() + "' acquire --connect 'sim:?speed=100&rate=50' ";
  EXPECT_EQ(WEXITSTATUS(std::system(
                (command + "--manual --plain --name '" + name_ + "' <&- >/dev/null 2>&1").c_str())),
            1);
  EXPECT_EQ(WEXITSTATUS(std::system(("'" + command_path() + "' acquire --resume '" + name_ +
                                     ".journal' --plain <&- >/dev/null 2>&1")
                                        .c_str())),
            1);
}

// An output may not have the path of an input.
TEST_F(FaultTest, ASessionOverwritesNoRecording) {
  const std::string log = folder_.write("log.csv", recording().csv());
  const std::vector<std::string> start = {
      "acquire",       "--connect", "file:" + log, "--unattended", "--plain", "--instrument",
      "accelerometer", "--field",   "gravity",     "--name",       name_};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), start.begin(), start.end());
    return run_axiscal(more).status;
  };
  EXPECT_EQ(with({"-o", log}), 2);
  EXPECT_EQ(with({"--report", log}), 2);
  EXPECT_EQ(with({"-o", name_ + ".x", "--record", name_ + ".x"}), 2);
  EXPECT_EQ(read_file(log), recording().csv());
  EXPECT_EQ(folder_.file_count(), 1U) << "no journal of a session that did not begin";
}

TEST_F(FaultTest, AnInstalledInstrumentIsCheckedWhereItIs) {
  EXPECT_EQ(session("file:" + folder_.write("log.csv", recording().csv())).status, 0);
  // A log of one pose without and with a shift of the bias by 5 mg.
  const std::vector<double> means = readings();
  for (const double shift : {0.0, 5e-3}) {
    RandomStream random(5);
    std::string text = "time,x,y,z\n";
    for (int i = 0; i < 1200; ++i) {
      text += number_text(0.01 * i);
      for (std::size_t k = 0; k < 3; ++k) {
        text += "," + number_text(means[6 + k] + shift + 1e-4 * random.normal());
      }
      text += "\n";
    }
    const ProgramResult result = run_axiscal(
        {"acquire", "--check", name_ + ".json", "--connect", "-", "--json"}, {.stdin_text = text});
    EXPECT_EQ(result.status, shift > 0.0 ? 1 : 0) << result.out << result.err;
    const std::size_t last = result.out.rfind('\n', result.out.size() - 2);
    const nlohmann::json verdict = nlohmann::json::parse(result.out.substr(last + 1));
    EXPECT_EQ(verdict["drifted"], shift > 0.0);
    EXPECT_EQ(verdict["readings"], 3);
    EXPECT_TRUE(verdict.contains("pitch_deg"));
  }
}

TEST(AcquireCommand, ListsKindsAndSaysWhatIsMissing) {
  const ProgramResult list = run_axiscal({"acquire", "--list", "--json"});
  EXPECT_EQ(list.status, 0);
  const nlohmann::json json = nlohmann::json::parse(list.out);
  EXPECT_EQ(json["kinds"].size(), 11U);
  EXPECT_EQ(run_axiscal({"acquire"}).status, 2);
  EXPECT_EQ(run_axiscal({"acquire", "--connect", "serial:"}).status, 2);
  const ProgramResult wrong =
      run_axiscal({"acquire", "--connect", "-", "--instrument", "accelerometer", "--field",
                   "gravity", "--unattended", "--name", "/tmp/axiscal-wrong-channels"},
                  {.stdin_text = "a,b,c\n1,2,3\n"});
  std::filesystem::remove("/tmp/axiscal-wrong-channels.journal");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("their channels are: a, b, c"), std::string::npos) << wrong.err;
}

}  // namespace
}  // namespace axiscal::test
