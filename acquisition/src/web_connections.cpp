// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/web_connections.hpp"

#ifdef AXISCAL_WEB
#include <algorithm>

namespace axiscal {
namespace {

constexpr std::size_t most_of_one_network = 32;
constexpr std::size_t most_connections = 512;

}  // namespace

void WebConnections::add(std::shared_ptr<WebConnection> connection) {
  all_.push_back(std::move(connection));
}

void WebConnections::remove(const WebConnection* connection) {
  all_.remove_if(
      [&](const std::shared_ptr<WebConnection>& one) { return one.get() == connection; });
}

void WebConnections::wake_all() {
  const std::list<std::shared_ptr<WebConnection>> now = all_;  // a copy: wake() may change all_
  for (const std::shared_ptr<WebConnection>& one : now) {
    one->wake();
  }
}

std::size_t WebConnections::count_of(const std::string& network) const {
  return static_cast<std::size_t>(std::count_if(
      all_.begin(), all_.end(),
      [&](const std::shared_ptr<WebConnection>& one) { return one->network() == network; }));
}

bool WebConnections::make_room(const std::string& network) {
  if (count_of(network) >= most_of_one_network) {
    return close_oldest(network);
  }
  if (all_.size() < most_connections) {
    return true;
  }
  std::string largest;
  std::size_t most = 0;
  for (const std::shared_ptr<WebConnection>& one : all_) {
    const std::size_t count = count_of(one->network());
    if (count > most) {
      most = count;
      largest = one->network();
    }
  }
  return close_oldest(largest);
}

bool WebConnections::close_oldest(const std::string& network) {
  const auto found =
      std::find_if(all_.begin(), all_.end(), [&](const std::shared_ptr<WebConnection>& one) {
        return one->network() == network && !one->watches();
      });
  if (found == all_.end()) {
    return false;
  }
  const std::shared_ptr<WebConnection> oldest = *found;  // a copy: close() removes the entry
  oldest->close();
  return true;
}

}  // namespace axiscal
#endif
