#include "api/dds/gate/handshake_assembly.hpp"

#include <algorithm>

namespace plchost::dds {

namespace {

using namespace submessage_kind;

// In a fragment: its sample's number, the first fragment, how many, their size, the size of all.
constexpr std::size_t kNumber = kSubmessageHeader + 12;
constexpr std::size_t kFirst = kNumber + 8;
constexpr std::size_t kCount = kFirst + 4;
constexpr std::size_t kSize = kCount + 2;
constexpr std::size_t kSampleSize = kSize + 2;

bool says_nothing(std::uint8_t kind) {
  return kind == kPad || kind == kInfoTimestamp || kind == kInfoDestination;
}

void put(std::vector<std::byte>& to, std::uint32_t number, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) to.push_back(static_cast<std::byte>(number >> (8 * i)));
}

bool has_fragments(std::span<const std::byte> datagram) noexcept {
  auto rest = datagram.subspan(kRtpsHeader);
  if (rest.empty() || byte_at(rest, 0) == kSecuredMessagePrefix) return false;
  while (!rest.empty()) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return false;
    if (submessage->kind() == kDataFragment) return true;
    rest = rest.subspan(submessage->bytes.size());
  }
  return false;
}

}  // namespace

HandshakeAssembly::HandshakeAssembly() : samples_(kSamples) {
  out_.reserve(2 * kMaxSample);
}

std::size_t HandshakeAssembly::rewrite(std::span<std::byte> buffer, std::size_t size) {
  const std::span<const std::byte> datagram = buffer.first(size);
  if (!has_fragments(datagram)) return size;
  out_.assign(datagram.begin(), datagram.begin() + kRtpsHeader);
  bool says_something = false;
  for (auto rest = datagram.subspan(kRtpsHeader); !rest.empty();) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return 0;
    rest = rest.subspan(submessage->bytes.size());
    if (submessage->kind() != kDataFragment) {
      out_.insert(out_.end(), submessage->bytes.begin(), submessage->bytes.end());
      says_something |= !says_nothing(submessage->kind());
      continue;
    }
    const auto fragment = read(datagram, *submessage);
    if (!fragment) continue;
    if (Sample* complete = add(*fragment)) {
      append(*complete);
      complete->size = 0;
      says_something = true;
    }
  }
  if (!says_something || out_.size() > buffer.size()) return 0;
  std::ranges::copy(out_, buffer.begin());
  return out_.size();
}

// Nothing: it is not what a fragment can be.
std::optional<HandshakeAssembly::Fragment> HandshakeAssembly::read(std::span<const std::byte> datagram,
                                                                   const Submessage& submessage) noexcept {
  const std::span<const std::byte> bytes = submessage.bytes;
  const bool little = submessage.little();
  const auto contents = contents_of_sample(submessage);
  if (contents.empty() || submessage.writer() != kHandshakeWriter) return std::nullopt;
  Fragment fragment{.number_high = number_at<std::uint32_t>(bytes, kNumber, little),
                    .number_low = number_at<std::uint32_t>(bytes, kNumber + 4, little),
                    .first = number_at<std::uint32_t>(bytes, kFirst, little) - 1,
                    .count = number_at<std::uint16_t>(bytes, kCount, little),
                    .size = number_at<std::uint16_t>(bytes, kSize, little),
                    .sample_size = number_at<std::uint32_t>(bytes, kSampleSize, little)};
  std::copy_n(datagram.begin() + kGuidPrefixAt, fragment.from.size(), fragment.from.begin());
  for (std::size_t i = 0; i < fragment.reader.size(); ++i)
    fragment.reader[i] = byte_at(bytes, kReaderEntity + i);
  if (fragment.size < kMinFragment || fragment.sample_size < kEncapsulation ||
      fragment.sample_size > kMaxSample) {
    return std::nullopt;
  }
  const std::uint32_t all = (fragment.sample_size + fragment.size - 1) / fragment.size;
  if (fragment.count == 0 || fragment.first >= all || fragment.count > all - fragment.first) {
    return std::nullopt;
  }
  const std::size_t wanted =
      std::min(fragment.count * fragment.size, fragment.sample_size - fragment.first * fragment.size);
  if (contents.size() < wanted) return std::nullopt;
  fragment.contents = contents.first(wanted);
  return fragment;
}

// Its sample, if it is complete now.
HandshakeAssembly::Sample* HandshakeAssembly::add(const Fragment& fragment) noexcept {
  Sample& sample = sample_of(fragment);
  if (sample.size != fragment.sample_size || sample.fragment_size != fragment.size) return nullptr;
  sample.last_use = ++uses_;
  const std::size_t at = std::size_t{fragment.first} * fragment.size;
  std::ranges::copy(fragment.contents, sample.bytes.begin() + static_cast<std::ptrdiff_t>(at));
  for (std::uint32_t i = 0; i < fragment.count; ++i) sample.there.set(fragment.first + i);
  const std::size_t all = (sample.size + sample.fragment_size - 1) / sample.fragment_size;
  return sample.there.count() == all ? &sample : nullptr;
}

HandshakeAssembly::Sample& HandshakeAssembly::sample_of(const Fragment& fragment) noexcept {
  const auto is_its = [&](const Sample& sample) {
    return sample.size != 0 && sample.from == fragment.from && sample.reader == fragment.reader &&
           sample.number_high == fragment.number_high && sample.number_low == fragment.number_low;
  };
  if (const auto known = std::ranges::find_if(samples_, is_its); known != samples_.end()) return *known;
  const auto use = [](const Sample& sample) { return sample.size == 0 ? 0 : sample.last_use; };
  Sample& oldest = *std::ranges::min_element(samples_, {}, use);
  oldest.from = fragment.from;
  oldest.reader = fragment.reader;
  oldest.number_high = fragment.number_high;
  oldest.number_low = fragment.number_low;
  oldest.fragment_size = fragment.size;
  oldest.size = fragment.sample_size;
  oldest.there.reset();
  return oldest;
}

void HandshakeAssembly::append(const Sample& sample) {
  const std::size_t padded = (std::size_t{sample.size} + 3) / 4 * 4;
  constexpr std::size_t kFields = kInlineQosCount + 2 + kDataFields - kSubmessageHeader;
  put(out_, kData, 1);
  put(out_, kLittleEndian | kDataHasContents, 1);
  put(out_, static_cast<std::uint32_t>(kFields + padded), 2);
  put(out_, 0, 2);
  put(out_, kDataFields, 2);
  for (const std::uint8_t byte : sample.reader) put(out_, byte, 1);
  for (const std::uint8_t byte : kHandshakeWriter) put(out_, byte, 1);
  put(out_, sample.number_high, 4);
  put(out_, sample.number_low, 4);
  out_.insert(out_.end(), sample.bytes.begin(), sample.bytes.begin() + sample.size);
  put(out_, 0, padded - sample.size);
}

}  // namespace plchost::dds
