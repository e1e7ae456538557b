// Real-time threads use the link that is there, while a soft thread exchanges it and lets go of old ones.

#include <array>
#include <memory>

#include "shm/block_driver/link_gate.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

constexpr int kLinks = 8;

/// Tells when it has gone.
struct Link {
  Link(std::array<int, kLinks>& gone_links, int its_number) noexcept : gone(gone_links), number(its_number) {}
  ~Link() { gone[static_cast<std::size_t>(number)] = 1; }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  std::array<int, kLinks>& gone;
  int number;
};

struct Shared {
  LinkGate<Link> gate;
  std::array<int, kLinks> gone{};  // plain: a look at a link that goes is a data race
  bool refused = false;

  [[nodiscard]] std::unique_ptr<Link> make_link(int number) { return std::make_unique<Link>(gone, number); }
  int use() {
    const auto link = gate.enter();
    if (!link) return 0;
    require(gone[static_cast<std::size_t>(link->number)] == 0, "a link goes while a thread is inside");
    return link->number;
  }
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.gate, "gate");
  scene.name(shared.gone, "gone");
  shared.gate.exchange(shared.make_link(1));
  return shared;
}

void two_users_one_exchange(Scene& scene) {
  Shared& shared = make(scene);
  for (const char* name : {"user", "other user"}) {
    scene.thread(name, [&] {
      shared.use();
      shared.use();
    });
  }
  scene.thread("owner", [&] {
    require(shared.gate.exchange(shared.make_link(2)), "there is room for an old link");
    shared.gate.collect();
  });
  scene.at_end([&] {
    shared.gate.collect();
    require(shared.gone[1] == 1, "an old link stays for ever");
    require(shared.gone[2] == 0 && shared.gate.get()->number == 2, "the link that is there has gone");
  });
}

// A user never sees an older state after a newer one.
void a_user_comes_back(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("user", [&] {
    const int first = shared.use();
    const int second = shared.use();
    require(second >= first || second == 0, "an old link is back");
    require(first != 0 || second == 0, "a closed gate is open again");
    observe(static_cast<unsigned>(first));
  });
  scene.thread("owner", [&] {
    shared.gate.exchange(shared.make_link(2));
    shared.gate.exchange(nullptr);
  });
  scene.at_end([&] {
    require(shared.gate.closed(), "the gate is closed");
    shared.gate.collect();
    require(shared.gone[1] == 1 && shared.gone[2] == 1, "an old link stays for ever");
  });
  scene.outcomes(7);  // the user finds each of the two, or a closed gate
}

// A user that does not come out keeps a bounded number of links.
void a_user_stays(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("user", [&] { shared.use(); });
  scene.thread("owner", [&] {
    bool refused = false;
    for (int number = 2; number < 7 && !refused; ++number)
      refused = !shared.gate.exchange(shared.make_link(number));
    shared.refused = refused;
  });
  scene.at_end([&] {
    observe(shared.refused ? 1 : 0);
    shared.gate.collect();
    int kept = 0;
    for (int number = 1; number < 7; ++number)
      kept += shared.gone[static_cast<std::size_t>(number)] == 0 ? 1 : 0;
    require(kept <= (shared.refused ? 2 : 1), "an old link stays for ever");
  });
  scene.outcomes(3);
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_users_one_exchange", two_users_one_exchange},
              {"a_user_comes_back", a_user_comes_back},
              {"a_user_stays", a_user_stays}});
}
