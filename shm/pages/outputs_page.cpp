#include "shm/pages/outputs_page.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <memory>
#include <new>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/files/registers.hpp"
#include "shm/log/log.hpp"
#include "shm/plc_process_image.h"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

constexpr PageKind kOutputsKind{.what = "page of outputs",
                                .magic = 0x65676170'7374756f,  // "outspage"
                                .version = 1};                 // 1: first

struct OutputEntry {
  FixedText<kMaxPath> name;  // of the object, or of the device
  std::uint32_t of_device = 0;
  std::uint32_t zero = 0;
  std::uint64_t address = 0;
  std::uint64_t size = 0;    // bytes of the values
  std::uint64_t values = 0;  // where they begin in the page
};

/// The layout; then the values.
struct OutputsLayout {
  std::uint64_t magic = 0;
  std::uint32_t version = 0;
  std::uint32_t count = 0;
  std::uint64_t size = 0;  // of all of it
  std::int64_t pid = 0;    // of the process whose outputs they are
  std::uint64_t start = 0;
  std::uint32_t program = 0;
  std::uint32_t zero = 0;
  std::array<OutputEntry, OutputsPage::kMost> entries;
};

std::size_t bytes_for(std::span<const LeftOutputs> outputs) {
  std::size_t bytes = sizeof(OutputsLayout);
  for (const LeftOutputs& one : outputs) bytes += one.values.size();
  return bytes;
}

void fill_outputs(std::span<std::byte> bytes, std::span<const LeftOutputs> outputs) {
  auto& page = *new (bytes.data()) OutputsLayout();
  const ProcessIdentity self = this_process();
  page.pid = self.pid;
  page.start = self.start;
  page.program = self.image;
  page.count = static_cast<std::uint32_t>(outputs.size());
  std::size_t at = sizeof(OutputsLayout);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const LeftOutputs& one = outputs[i];
    page.entries[i] = {.name = FixedText<kMaxPath>(one.object.empty() ? one.device : one.object),
                       .of_device = one.object.empty() ? 1U : 0U,
                       .address = one.address,
                       .size = one.values.size(),
                       .values = at};
    std::ranges::copy(one.values, bytes.begin() + static_cast<std::ptrdiff_t>(at));
    at += one.values.size();
  }
  describe_page(page, kOutputsKind, bytes.size());
}

// The process that writes the page may change it at any time: all is checked and used in this copy. The
// values are only copied on.
std::unique_ptr<const OutputsLayout> copy_of_layout(std::span<const std::byte> bytes) {
  auto copy = std::make_unique<OutputsLayout>(*reinterpret_cast<const OutputsLayout*>(bytes.data()));
  std::atomic_signal_fence(std::memory_order_seq_cst);  // the compiler reads nothing there again
  return copy;
}

bool is_whole_page(const OutputsLayout& page, std::size_t bytes) {
  const auto fits = [&](const OutputEntry& entry) {
    return entry.values >= sizeof(OutputsLayout) && entry.values <= bytes &&
           entry.size <= bytes - entry.values && entry.name.bytes.back() == '\0';
  };
  return is_described(page, kOutputsKind, bytes) && page.count <= OutputsPage::kMost &&
         std::ranges::all_of(std::span(page.entries).first(page.count), fits);
}

Result<void> end_image(const std::string& pool, const std::string& name, std::int64_t pid) {
  PLCHOST_TRY_ASSIGN(
      const auto memory,
      MemoryFile::open(pool_memory_name(pool, name), sizeof(plc_image_header), MemoryFile::Access::read_write,
                       [&](uid_t owner) { return may_own_memory(pool, owner); }));
  plc_image image{};
  image.header = reinterpret_cast<plc_image_header*>(memory.bytes().data());
  image.mapped = memory.bytes().size();
  const std::uint64_t size = image.header->size;
  image.size = static_cast<unsigned>(size);
  const bool whole = size >= 1 && size <= PLC_IMAGE_MAX_SIZE &&
                     plc_image_is_one(image.header, image.size) != 0 &&
                     plc_image_bytes(image.size) == image.mapped;
  if (!whole) return failure(ErrorCode::corrupt, "its header says that it is no image of this version");
  (void)plc_image_end_of(&image, static_cast<plc_image_u64>(pid));
  return {};
}

Result<void> write_registers(const OutputEntry& entry, std::span<const std::byte> values) {
  const std::string path(entry.name.view());
  const UniqueFd fd(::open(path.c_str(), O_RDWR | O_SYNC | O_CLOEXEC | O_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, "cannot open it", errno);
  struct stat status{};
  if (::fstat(fd.get(), &status) != 0) return failure(ErrorCode::system, "fstat", errno);
  const auto file_size = static_cast<std::uint64_t>(status.st_size);
  const bool allowed = S_ISCHR(status.st_mode) || (S_ISREG(status.st_mode) && entry.address <= file_size &&
                                                   values.size() <= file_size - entry.address);
  if (!allowed) return failure(ErrorCode::refused, "it is not the device any more, or shorter");
  PLCHOST_TRY_ASSIGN(const auto mapped, map_registers(fd.get(), path, entry.address, values.size()));
  copy_to_registers(mapped.bytes, values);
  return {};
}

Result<void> end_entry(const std::string& pool, const OutputEntry& entry, std::span<const std::byte> page,
                       std::int64_t pid) {
  if (entry.of_device == 0) return end_image(pool, std::string(entry.name.view()), pid);
  return write_registers(entry, page.subspan(entry.values, entry.size));
}

}  // namespace

std::string outputs_page_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.outputs.{}", pool, instance);
}

Result<OutputsPage> OutputsPage::create(std::string_view pool, std::string_view instance,
                                        std::span<const LeftOutputs> outputs) {
  if (outputs.size() > kMost) {
    return failure(ErrorCode::full,
                   fmt::format("{} areas of outputs, {} are allowed", outputs.size(), kMost));
  }
  // Cut short it would name another file, and the manager would write that.
  const auto long_one =
      std::ranges::find_if(outputs, [](const LeftOutputs& one) { return one.device.size() > kMaxPath; });
  if (long_one != outputs.end()) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("the path of the device {} has {} bytes, {} are allowed", long_one->device,
                               long_one->device.size(), kMaxPath));
  }
  const std::string name = outputs_page_name(pool, instance);
  const auto fill = [&](std::span<std::byte> bytes) -> Result<void> {
    fill_outputs(bytes, outputs);
    return {};
  };
  PLCHOST_TRY(MemoryFile::replace(name, bytes_for(outputs), fill, {.mode = 0600}));
  return OutputsPage(name);
}

OutputsPage::~OutputsPage() {
  if (!name_.empty()) MemoryFile::remove(name_);
}

void OutputsPage::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(outputs_page_name(pool, instance));
}

void end_outputs(std::string_view pool, std::string_view instance, const OwnerCheck& owners) {
  const std::string name = outputs_page_name(pool, instance);
  const auto memory = open_of_magic<OutputsLayout>(name, kOutputsKind, MemoryFile::Access::read_only, owners);
  if (!memory) {
    if (memory.error().code != ErrorCode::not_found)
      spdlog::warn("instance {}: its outputs stay as they are: {}", instance, memory.error().describe());
    return;
  }
  const std::span<const std::byte> bytes = memory->bytes();
  const auto copy = copy_of_layout(bytes);
  const OutputsLayout& page = *copy;
  if (!is_whole_page(page, bytes.size())) {
    spdlog::warn("instance {}: its outputs stay as they are: {} is damaged, or of another version", instance,
                 name);
    return;
  }
  if (!process_has_ended({.pid = static_cast<pid_t>(page.pid), .image = page.program, .start = page.start}))
    return;
  for (const OutputEntry& entry : std::span(page.entries).first(page.count)) {
    const auto ended = end_entry(std::string(pool), entry, bytes, page.pid);
    if (ended) continue;
    spdlog::warn("instance {}: outputs in {} are not put into their safe state: {}", instance,
                 entry.name.view(), ended.error().describe());
  }
  // Not that of a process that has begun meanwhile.
  const auto now = MemoryFile::open(name, sizeof(OutputsLayout), MemoryFile::Access::read_only);
  if (now && now->same_file(*memory)) MemoryFile::remove(name);
}

}  // namespace plchost
