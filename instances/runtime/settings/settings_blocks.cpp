// [CmpBlkDrvShm] and [CmpRouter]: the instance as a node that talks to others.
#include <algorithm>
#include <array>
#include <charconv>

#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"
#include "shm/block_driver/block.hpp"
#include "shm/block_driver/node_directory.hpp"

namespace plchost {

namespace {

constexpr std::string_view kDriver = "CmpBlkDrvShm";
constexpr std::string_view kRouter = "CmpRouter";
constexpr std::array<std::string_view, 6> kQueueSlots = {"512", "1024", "2048", "4096", "8192", "16384"};

BlockSettings& blocks_of(const SettingsTarget& target) {
  return target.settings.blocks;
}

bool is_base_name(std::string_view text) {
  return check_name("base name", text, kMaxBlockBase).has_value();
}

/// "line1, line2"
std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    std::string_view word = text.substr(0, comma);
    while (word.starts_with(' ')) word.remove_prefix(1);
    while (word.ends_with(' ')) word.remove_suffix(1);
    words.emplace_back(word);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return words;
}

bool are_node_names(std::string_view text) {
  return std::ranges::all_of(words_of(text), [](const std::string& word) {
    return check_name("node", word, kMaxInstanceName).has_value();
  });
}

constexpr std::array kBlockKeys = {
    SettingKey{.section = kDriver,
               .name = "Enable",
               .unit = "1 is a node also without a channel",
               .initial = "0",
               .meaning = "the instance is a node from its start",
               .value = NumberSetting{0, 1,
                                      [](const SettingsTarget& to, std::int64_t enable) {
                                        blocks_of(to).enable = enable != 0;
                                      }}},
    SettingKey{.section = kDriver,
               .name = "BaseName",
               .initial = kDefaultBlockBase,
               .meaning = "nodes of the same base name in the same pool see each other",
               .value = TextSetting{"1 to 31 letters, digits, _ - .", is_base_name,
                                    [](const SettingsTarget& to, std::string_view name) {
                                      blocks_of(to).base = name;
                                    }}},
    SettingKey{
        .section = kDriver,
        .name = "ForcedAddress",
        .meaning = "address of the node; without it any free one. An address that is taken ends the start",
        .value = NumberSetting{1, kMaxNodes,
                               [](const SettingsTarget& to, std::int64_t address) {
                                 blocks_of(to).forced_address = static_cast<std::uint16_t>(address);
                               }}},
    SettingKey{.section = kDriver,
               .name = "QueueSlots",
               .initial = "1024",
               .meaning = "slots of 256 bytes in each of the four queues of a link that it makes",
               .value = WordSetting{kQueueSlots,
                                    [](const SettingsTarget& to, std::size_t index) {
                                      const std::string_view word = kQueueSlots[index];
                                      std::from_chars(word.data(), word.data() + word.size(),
                                                      blocks_of(to).queue_slots);
                                    }}},
    SettingKey{.section = kDriver,
               .name = "HoldMs",
               .unit = "ms",
               .initial = "1000",
               .meaning = "a block that nobody receives for this time is dropped and counted",
               .value = NumberSetting{100, 60'000,
                                      [](const SettingsTarget& to, std::int64_t ms) {
                                        blocks_of(to).hold = std::chrono::milliseconds(ms);
                                      }}},
    SettingKey{
        .section = kRouter,
        .name = "Neighbours",
        .meaning = "instances that it exchanges blocks with directly",
        .value = TextSetting{"names of instances with commas between; without it all are", are_node_names,
                             [](const SettingsTarget& to, std::string_view names) {
                               blocks_of(to).neighbours = words_of(names);
                             }}},
    SettingKey{.section = kRouter,
               .name = "Forward",
               .unit = "1 is on",
               .initial = "1",
               .meaning = "blocks of other nodes may go through it",
               .value = NumberSetting{0, 1,
                                      [](const SettingsTarget& to,
                                         std::int64_t forward) { blocks_of(to).forward = forward != 0; }}},
    SettingKey{.section = kRouter,
               .name = "HopLimit",
               .initial = "8",
               .meaning = "nodes that a block may go through",
               .value =
                   NumberSetting{
                       1, kMaxHops,
                       [](const SettingsTarget& to,
                          std::int64_t hops) { blocks_of(to).hop_limit = static_cast<std::uint8_t>(hops); }}},
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
