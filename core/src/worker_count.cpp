// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/worker_count.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <thread>

#ifdef __linux__
#include <sched.h>
#endif

namespace axiscal {
namespace {

std::atomic<std::size_t> stated_count = 0;

// @return the number in the text; 0 if it is not a whole number of at least 1.
std::size_t count_of(std::string_view text) {
  std::size_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc() && end == text.data() + text.size() ? count : 0;
}

#ifdef __linux__
// @return quota / period, the number of processors that a control group may use; infinity if the
//         group has no quota.
double quota_of(double quota, double period) {
  return quota > 0.0 && period > 0.0 ? quota / period : std::numeric_limits<double>::infinity();
}

double number_in(const std::string& path) {
  double number = 0.0;
  std::ifstream(path) >> number;
  return number;
}

// Returns the smallest CPU quota, as a number of processors, of this process's control group and
// the group's parents. In version 2 of control groups, one file contains quota and period, such as
// "max 100000" or "150000 100000". In version 1, quota and period are in separate files.
double quota_of_container() {
  double least = std::numeric_limits<double>::infinity();
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (second == std::string::npos) {
      continue;
    }
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool is_v1 = ("," + controllers + ",").find(",cpu,") != std::string::npos;
    if (!is_v1 && !controllers.empty()) {
      continue;
    }
    const std::string root = is_v1 ? "/sys/fs/cgroup/cpu" : "/sys/fs/cgroup";
    for (std::string group = line.substr(second + 1);; group.resize(group.rfind('/'))) {
      if (is_v1) {
        least = std::min(least, quota_of(number_in(root + group + "/cpu.cfs_quota_us"),
                                         number_in(root + group + "/cpu.cfs_period_us")));
      } else {
        double quota = 0.0;
        double period = 0.0;
        std::ifstream(root + group + "/cpu.max") >> quota >> period;
        least = std::min(least, quota_of(quota, period));
      }
      if (group.rfind('/') == std::string::npos) {
        break;
      }
    }
  }
  return least;
}
#endif

std::size_t usable_processors() {
  std::size_t count = std::max(std::thread::hardware_concurrency(), 1U);
#ifdef __linux__
  cpu_set_t set;
  if (::sched_getaffinity(0, sizeof set, &set) == 0) {
    count = std::max<std::size_t>(static_cast<std::size_t>(CPU_COUNT(&set)), 1);
  }
  const double quota = quota_of_container();
  if (quota < static_cast<double>(count)) {
    count = std::max<std::size_t>(static_cast<std::size_t>(std::ceil(quota)), 1);
  }
#endif
  return count;
}

}  // namespace

std::size_t worker_count() {
  if (const std::size_t count = stated_count; count > 0) {
    return count;
  }
  static const std::size_t found = [] {
    const char* const stated = std::getenv("AXISCAL_THREADS");
    const std::size_t count = stated != nullptr ? count_of(stated) : 0;
    return count > 0 ? count : usable_processors();
  }();
  return found;
}

void set_worker_count(std::size_t count) {
  stated_count = count;
}

}  // namespace axiscal
