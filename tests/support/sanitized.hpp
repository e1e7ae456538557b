#pragma once

namespace plchost {

/// Whether this is compiled with a sanitizer of memory or threads: all takes ten times as long, the heap is
/// the sanitizer's own, and its shadow memory faults.
#if defined(PLCHOST_ADDRESS_SANITIZER) || defined(PLCHOST_THREAD_SANITIZER)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace plchost
