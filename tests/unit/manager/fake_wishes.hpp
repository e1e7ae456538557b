#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "manager/store/wish_keeper.hpp"

namespace plchost {

/// The wish of one instance, in the hands of a test: it outlives the instance, as a manager's memory does.
class FakeWishes : public WishKeeper {
 public:
  [[nodiscard]] Result<std::optional<InstanceWish>> find() override {
    if (on_find) on_find();
    if (damaged) return failure(ErrorCode::corrupt, "/state/line1: its checksum does not fit its contents");
    return wish;
  }
  void keep(const InstanceWish& now) override {
    wish = now;
    ++writes;
  }
  void keep_events() override { ++kept_events; }
  void when_kept(Kept kept) override {
    if (disk_is_slow) {
      waiting.push_back(std::move(kept));
    } else {
      kept(problem);
    }
  }

  [[nodiscard]] bool is_writing() const override { return writing; }

  std::function<void()> on_find;
  std::optional<InstanceWish> wish;
  bool damaged = false;
  bool disk_is_slow = false;
  bool writing = false;
  std::string problem;
  std::vector<Kept> waiting;
  int writes = 0;
  int kept_events = 0;
};

}  // namespace plchost
