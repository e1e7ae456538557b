#include <cstdlib>
#include <cstring>
#include <new>

#include "tests/models/checker/explorer.hpp"

namespace plchost::models {

namespace {

constexpr std::size_t kSize = 1UL << 20U;
alignas(1UL << 20U) std::byte memory[kSize];
std::size_t used = 0;
bool in_use = false;

}  // namespace

void Arena::reset() noexcept {
  std::memset(memory, 0, used);
  used = 0;
}

void* Arena::take(std::size_t size, std::size_t alignment) {
  used = (used + alignment - 1) / alignment * alignment;
  if (size > kSize - used) throw std::bad_alloc();
  void* const taken = memory + used;
  used += size;
  return taken;
}

bool Arena::holds(std::uintptr_t address) noexcept {
  return address - reinterpret_cast<std::uintptr_t>(memory) < kSize;
}

std::uint64_t Arena::hash() noexcept {
  std::uint64_t hash = used;
  for (std::size_t i = 0; i < used; i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, memory + i, sizeof word);
    hash = mix(hash, word);
  }
  return hash;
}

bool Arena::is_in_use() noexcept {
  return in_use;
}

Arena::Use::Use(bool on) noexcept : before_(in_use) {
  in_use = on;
}
Arena::Use::~Use() {
  in_use = before_;
}

}  // namespace plchost::models

// NOLINTBEGIN(misc-new-delete-overloads,cppcoreguidelines-no-malloc): all of them are here
namespace {

void* take(std::size_t size, std::size_t alignment) {
  using plchost::models::Arena;
  if (Arena::is_in_use()) return Arena::take(size, alignment);
  void* const taken = alignment > alignof(std::max_align_t)
                          ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                          : std::malloc(size == 0 ? 1 : size);
  if (taken == nullptr) throw std::bad_alloc();
  return taken;
}

void give_back(void* taken) noexcept {
  if (!plchost::models::Arena::holds(reinterpret_cast<std::uintptr_t>(taken))) std::free(taken);
}

}  // namespace

void* operator new(std::size_t size) {
  return take(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size) {
  return take(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return take(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return take(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* taken) noexcept {
  give_back(taken);
}
void operator delete[](void* taken) noexcept {
  give_back(taken);
}
void operator delete(void* taken, std::size_t /*size*/) noexcept {
  give_back(taken);
}
void operator delete[](void* taken, std::size_t /*size*/) noexcept {
  give_back(taken);
}
void operator delete(void* taken, std::align_val_t /*alignment*/) noexcept {
  give_back(taken);
}
void operator delete[](void* taken, std::align_val_t /*alignment*/) noexcept {
  give_back(taken);
}
void operator delete(void* taken, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  give_back(taken);
}
void operator delete[](void* taken, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  give_back(taken);
}
// NOLINTEND(misc-new-delete-overloads,cppcoreguidelines-no-malloc)
