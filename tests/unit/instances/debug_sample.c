// Code whose lines are known: each function returns its own, and calls back from there.
typedef void (*Call)(void);

int own_line(void) {
  return __LINE__;
}

static __attribute__((noinline)) int hidden(Call call) {
  call();
  return __LINE__ - 1;
}

int line_of_hidden(Call call) {
  return hidden(call);
}

// As a translator of Structured Text tells where its C code comes from.
#line 7 "plc/Mixer.st"
int line_of_structured_text(void) {
  return __LINE__;
}
