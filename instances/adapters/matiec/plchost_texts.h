/*
 * MID, INSERT, DELETE, REPLACE and FIND for the programs of MATIEC. Its own library cuts the new text of
 * REPLACE to the length of the old one. It counts lengths modulo 256, and reads before a text if P is 0. FIND
 * passes over a text that begins within one that it has begun to compare. This is a part of
 * plchost_library.h, which includes it behind that library.
 */
#ifndef PLCHOST_TEXTS_H
#define PLCHOST_TEXTS_H

/* How many of the wanted characters there are from an index on. */
static inline int plchost_present(const STRING* text, LINT wanted, int index) {
  const int rest = text->len > index ? text->len - index : 0;
  return wanted < rest ? (int)wanted : rest;
}
/* As many as there is room for. */
static inline void plchost_append(STRING* text, const uint8_t* characters, int count) {
  if (count > STR_MAX_LEN - text->len) count = STR_MAX_LEN - text->len;
  memcpy(&text->body[text->len], characters, (size_t)count);
  text->len += (__strlen_t)count;
}
static inline BOOL plchost_text_is_wanted(BOOL EN, BOOL* ENO, BOOL can) {
  if (ENO != NULL) *ENO = EN && can;
  return EN && can;
}

static inline STRING plchost_mid(BOOL EN, BOOL* ENO, STRING text, LINT length, LINT position) {
  STRING result = __INIT_STRING;
  if (!plchost_text_is_wanted(EN, ENO, length >= 0 && position >= 1) || position > text.len) return result;
  plchost_append(&result, &text.body[position - 1], plchost_present(&text, length, (int)position - 1));
  return result;
}

/* The characters behind a position are put in the place of others. */
static inline STRING plchost_put(STRING text, STRING other, LINT length, LINT behind) {
  STRING result = __INIT_STRING;
  const int first = plchost_present(&text, behind, 0);
  const int end = first + plchost_present(&text, length, first);
  plchost_append(&result, text.body, first);
  plchost_append(&result, other.body, other.len);
  plchost_append(&result, &text.body[end], text.len - end);
  return result;
}
static inline STRING plchost_insert(BOOL EN, BOOL* ENO, STRING text, STRING other, LINT behind) {
  if (!plchost_text_is_wanted(EN, ENO, behind >= 0)) return __INIT_STRING;
  return plchost_put(text, other, 0, behind);
}
static inline STRING plchost_delete(BOOL EN, BOOL* ENO, STRING text, LINT length, LINT position) {
  if (!plchost_text_is_wanted(EN, ENO, length >= 0 && position >= 1)) return __INIT_STRING;
  return plchost_put(text, __INIT_STRING, length, position - 1);
}
static inline STRING plchost_replace(BOOL EN, BOOL* ENO, STRING text, STRING other, LINT length,
                                     LINT position) {
  if (!plchost_text_is_wanted(EN, ENO, length >= 0 && position >= 1)) return __INIT_STRING;
  return plchost_put(text, other, length, position - 1);
}

/* 0: the text is empty, or not there. */
static inline int plchost_find(BOOL EN, BOOL* ENO, STRING text, STRING wanted) {
  int first;
  if (!plchost_text_is_wanted(EN, ENO, TRUE) || wanted.len == 0) return 0;
  for (first = 0; first + wanted.len <= text.len; ++first) {
    if (memcmp(&text.body[first], wanted.body, (size_t)wanted.len) == 0) return first + 1;
  }
  return 0;
}

/* iec2c calls a function by the types of its result and its arguments. */
#define MID__STRING__STRING__SINT__SINT plchost_mid
#define MID__STRING__STRING__INT__INT plchost_mid
#define MID__STRING__STRING__DINT__DINT plchost_mid
#define MID__STRING__STRING__LINT__LINT plchost_mid
#define MID__STRING__STRING__USINT__USINT plchost_mid
#define MID__STRING__STRING__UINT__UINT plchost_mid
#define MID__STRING__STRING__UDINT__UDINT plchost_mid
#define MID__STRING__STRING__ULINT__ULINT plchost_mid
#define INSERT__STRING__STRING__STRING__SINT plchost_insert
#define INSERT__STRING__STRING__STRING__INT plchost_insert
#define INSERT__STRING__STRING__STRING__DINT plchost_insert
#define INSERT__STRING__STRING__STRING__LINT plchost_insert
#define INSERT__STRING__STRING__STRING__USINT plchost_insert
#define INSERT__STRING__STRING__STRING__UINT plchost_insert
#define INSERT__STRING__STRING__STRING__UDINT plchost_insert
#define INSERT__STRING__STRING__STRING__ULINT plchost_insert
#define DELETE__STRING__STRING__SINT__SINT plchost_delete
#define DELETE__STRING__STRING__INT__INT plchost_delete
#define DELETE__STRING__STRING__DINT__DINT plchost_delete
#define DELETE__STRING__STRING__LINT__LINT plchost_delete
#define DELETE__STRING__STRING__USINT__USINT plchost_delete
#define DELETE__STRING__STRING__UINT__UINT plchost_delete
#define DELETE__STRING__STRING__UDINT__UDINT plchost_delete
#define DELETE__STRING__STRING__ULINT__ULINT plchost_delete
#define REPLACE__STRING__STRING__STRING__SINT__SINT plchost_replace
#define REPLACE__STRING__STRING__STRING__INT__INT plchost_replace
#define REPLACE__STRING__STRING__STRING__DINT__DINT plchost_replace
#define REPLACE__STRING__STRING__STRING__LINT__LINT plchost_replace
#define REPLACE__STRING__STRING__STRING__USINT__USINT plchost_replace
#define REPLACE__STRING__STRING__STRING__UINT__UINT plchost_replace
#define REPLACE__STRING__STRING__STRING__UDINT__UDINT plchost_replace
#define REPLACE__STRING__STRING__STRING__ULINT__ULINT plchost_replace
#define FIND__SINT__STRING__STRING plchost_find
#define FIND__INT__STRING__STRING plchost_find
#define FIND__DINT__STRING__STRING plchost_find
#define FIND__LINT__STRING__STRING plchost_find
#define FIND__USINT__STRING__STRING plchost_find
#define FIND__UINT__STRING__STRING plchost_find
#define FIND__UDINT__STRING__STRING plchost_find
#define FIND__ULINT__STRING__STRING plchost_find

#endif
