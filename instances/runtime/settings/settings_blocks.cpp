// [CmpBlkDrvShm] and [CmpRouter]: the instance as a node that talks to others.
#include <algorithm>
#include <array>
#include <charconv>

#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"
#include "shm/block_driver/block.hpp"
#include "shm/block_driver/node_directory.hpp"

namespace plchost {

namespace {

using std::chrono::milliseconds;

constexpr std::string_view kDriver = "CmpBlkDrvShm";
constexpr std::string_view kRouter = "CmpRouter";
constexpr std::array<std::string_view, 6> kQueueSlots = {"512", "1024", "2048", "4096", "8192", "16384"};

template <auto kMember>
using BlocksAt = At<&InstanceSettings::blocks, kMember>;

std::uint32_t slots_of(std::string_view word) {
  std::uint32_t slots = 0;
  std::from_chars(word.data(), word.data() + word.size(), slots);
  return slots;
}

void set_queue_slots(const SettingsTarget& to, std::size_t index) {
  to.settings.blocks.queue_slots = slots_of(kQueueSlots[index]);
}

std::size_t initial_queue_slots() {
  const auto word = std::ranges::find(kQueueSlots, BlockSettings{}.queue_slots, slots_of);
  return static_cast<std::size_t>(word - kQueueSlots.begin());
}

bool is_base_name(std::string_view text) {
  return check_name("base name", text, kMaxBlockBase).has_value();
}

/// "line1, line2"
std::vector<std::string> names_in(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    words.emplace_back(trimmed(text.substr(0, comma)));
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return words;
}

bool are_node_names(std::string_view text) {
  return std::ranges::all_of(names_in(text), [](const std::string& word) {
    return check_name("node", word, kMaxInstanceName).has_value();
  });
}

constexpr std::array kBlockKeys = {
    SettingKey{.section = kDriver,
               .name = "Enable",
               .unit = "1 is a node also without a channel",
               .meaning = "the instance is a node from its start",
               .value = truth_setting<BlocksAt<&BlockSettings::enable>>()},
    SettingKey{.section = kDriver,
               .name = "BaseName",
               .meaning = "nodes of the same base name in the same pool see each other",
               .value = text_setting<BlocksAt<&BlockSettings::base>>("1 to 31 letters, digits, _ - .",
                                                                     is_base_name)},
    SettingKey{
        .section = kDriver,
        .name = "ForcedAddress",
        .meaning = "address of the node; without it any free one. An address that is taken ends the start",
        .value = number_setting<BlocksAt<&BlockSettings::forced_address>>(1, kMaxNodes)},
    SettingKey{.section = kDriver,
               .name = "QueueSlots",
               .meaning = "slots of 256 bytes in each of the four queues of a link that it makes",
               .value = WordSetting{kQueueSlots, set_queue_slots, initial_queue_slots}},
    SettingKey{.section = kDriver,
               .name = "HoldMs",
               .unit = "ms",
               .meaning = "a block that nobody receives for this time is dropped and counted",
               .value = number_setting<BlocksAt<&BlockSettings::hold>, As<milliseconds>>(100, 60'000)},
    SettingKey{
        .section = kRouter,
        .name = "Neighbours",
        .meaning = "instances that it exchanges blocks with directly",
        .value = TextSetting{"names of instances with commas between; without it all are", are_node_names,
                             [](const SettingsTarget& to, std::string_view names) {
                               to.settings.blocks.neighbours = names_in(names);
                             }}},
    SettingKey{.section = kRouter,
               .name = "Forward",
               .unit = "1 is on",
               .meaning = "blocks of other nodes may go through it",
               .value = truth_setting<BlocksAt<&BlockSettings::forward>>()},
    SettingKey{.section = kRouter,
               .name = "HopLimit",
               .meaning = "nodes that a block may go through",
               .value = number_setting<BlocksAt<&BlockSettings::hop_limit>>(1, kMaxHops)},
    // Subnets of their router: here all nodes of a pool are in one.
    SettingKey{.section = kRouter, .name = "0.MainNet"},
    SettingKey{.section = kRouter, .name = "0.NumSubNets"},
    SettingKey{.section = kRouter, .name = "0.SubNet.0.Interface"},
    SettingKey{.section = kRouter, .name = "0.SubNet.1.Interface"},
    SettingKey{.section = kRouter, .name = "NumRouters"},
};

}  // namespace

std::span<const SettingKey> block_keys() noexcept {
  return kBlockKeys;
}

}  // namespace plchost
