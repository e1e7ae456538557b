#include "manager/store/wish_memory.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/files/fixed_page.hpp"

namespace plchost {

namespace {

constexpr PageKind kWishKind{.what = "memory of an instance's wish",
                             .magic = 0x68736977'6e616c70,  // "planwish"
                             .version = 1};                 // 1: first

std::string wish_memory_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.wish.{}", pool, instance);
}

// The manager alone writes and reads it.
PageRights wish_rights() {
  return {.owners = is_own_or_roots, .memory = {.mode = 0600}};
}

// A file that another user has put there in the place of none was never a wish.
bool is_damaged(const Error& error) noexcept {
  return error.code != ErrorCode::not_found && error.code != ErrorCode::refused &&
         error.code != ErrorCode::wrong_type;
}

}  // namespace

struct WishMemory::Layout {
  struct Place {
    std::uint64_t generation = 0;  // written last
    std::uint64_t length = 0;
    std::array<char, kMaxWishBytes> text{};
  };
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t size = 0;
  std::array<Place, 2> places;
};

WishMemory::Layout& WishMemory::layout() const noexcept {
  return *reinterpret_cast<Layout*>(memory_.bytes().data());
}

Result<WishMemory> WishMemory::open(std::string_view pool, std::string_view instance) {
  const std::string name = wish_memory_name(pool, instance);
  const auto before =
      open_fixed_page<Layout>(name, kWishKind, MemoryFile::Access::read_only, wish_rights().owners);
  const bool damaged = !before && is_damaged(before.error());
  // For the managers to come: something was written, and none of it is whole.
  const auto mark = [damaged](Layout& page) {
    if (!damaged) return;
    page.places[0].generation = 1;
    page.places[0].length = std::numeric_limits<std::uint64_t>::max();
  };
  auto memory = open_or_make_page<Layout>(name, kWishKind, Replaces::anything, mark, wish_rights());
  if (!memory && damaged) return failure(ErrorCode::corrupt, memory.error().describe());
  PLCHOST_TRY(memory);
  WishMemory opened(name, *std::move(memory));
  Found found = opened.newest();
  opened.generation_ = found.generation;
  opened.text_ = std::move(found.text);
  return opened;
}

void WishMemory::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(wish_memory_name(pool, instance));
}

std::vector<std::string> WishMemory::instances(std::string_view pool) {
  const std::string prefix = wish_memory_name(pool, "");
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const std::string file = at->path().filename().string();
    if (!file.starts_with(prefix)) continue;
    std::string name = file.substr(prefix.size());
    if (check_name("instance", name, kMaxInstanceName)) names.push_back(std::move(name));
  }
  return names;
}

WishMemory::Found WishMemory::newest() const {
  Found found;
  for (std::size_t i = 0; i < layout().places.size(); ++i) {
    const Layout::Place& place = layout().places[i];
    const std::uint64_t generation = place.generation;
    const std::uint64_t length = place.length;
    found.any = found.any || generation != 0;
    if (generation <= found.generation || length > place.text.size()) continue;
    // A copy: the checksum is of the bytes that are read, even if another program writes meanwhile.
    std::string text(place.text.data(), length);
    if (auto wish = decode_wish(text)) {
      found.wish = *std::move(wish);
      found.text = std::move(text);
      found.generation = generation;
      found.place = i;
    }
  }
  return found;
}

bool WishMemory::holds(std::size_t place) const {
  const Layout::Place& at = layout().places[place];
  return at.generation == generation_ && at.length == text_.size() &&
         std::string_view(at.text.data(), text_.size()) == text_;
}

void WishMemory::fill(std::size_t place) {
  Layout::Place& at = layout().places[place];
  at.generation = 0;
  std::atomic_signal_fence(std::memory_order_seq_cst);  // a kill sees the order of the program
  at.length = text_.size();
  std::ranges::copy(text_, at.text.begin());
  std::atomic_signal_fence(std::memory_order_seq_cst);
  at.generation = generation_;
}

// The place with the newest whole wish comes last: that wish is there until the other place has the new one.
Result<void> WishMemory::write(const InstanceWish& wish) {
  std::string text = encode(wish);
  if (text.size() > kMaxWishBytes) {
    return failure(ErrorCode::full, fmt::format("{} bytes; {} have room", text.size(), kMaxWishBytes));
  }
  const std::size_t last = newest().place;
  text_ = std::move(text);
  ++generation_;
  fill(1 - last);
  fill(last);
  return {};
}

Result<bool> WishMemory::mend() {
  if (text_.empty()) return false;
  const bool headed = is_described(layout(), kWishKind);
  if (headed && holds(0) && holds(1)) return false;
  if (memory_.lost()) {  // it has been looked at
    PLCHOST_TRY_ASSIGN(memory_, MemoryFile::replace(name_, sizeof(Layout), new_page<Layout>(kWishKind),
                                                    wish_rights().memory));
  }
  const std::size_t whole = holds(0) ? 0 : 1;
  fill(1 - whole);
  if (!holds(whole)) fill(whole);
  describe_page(layout(), kWishKind);
  return true;
}

}  // namespace plchost
