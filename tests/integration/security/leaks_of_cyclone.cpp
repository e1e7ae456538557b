// Cyclone DDS 0.10 decodes what it receives once for each secured participant of a process, and frees the
// last result only (q_omg_security_decode_rtps_message()). Several clients are in one process in these tests.
// Leaks of Cyclone's memory by the client library are found by the tests without security.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)

extern "C" const char* __lsan_default_suppressions();  // NOLINT: the sanitizer's name for it

// By the library: behind its malloc the sanitizer sees no caller.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT
  return "leak:libddsc.so\n";
}

#endif
#endif
