/*
 * Firmware as it was written for the seed's table: finds objects by walking g_PlcObjTab. Only the header is
 * another one. The pool is the one that PLCHOST_POOL names.
 *
 *     walk NAME       says what it is, and takes from or gives to it
 */
#include <plc_obj_tab.h>
#include <stdio.h>
#include <string.h>

static objEntry_t* find_object(const char* pszName) {
  unsigned long i;
  for (i = 0; i < g_PlcObjTab->ulSize; ++i)
    if (strcmp(g_PlcObjTab->ptEntries[i].pszName, pszName) == 0) return &g_PlcObjTab->ptEntries[i];
  return NULL;
}

static int use_object(const objEntry_t* ptEntry) {
  switch (ptEntry->tType) {
    case e_shm:
      printf("memory of %lu bytes, the first is %u\n", ptEntry->u.tShmEntry.ulSize,
             (unsigned int)*(const unsigned char*)ptEntry->u.tShmEntry.ulAddress);
      return 0;
    case e_sem:
      if (semTake(ptEntry->u.tSemEntry.hSem, 100) != OK) return 1;
      printf("semaphore, taken and given\n");
      return semGive(ptEntry->u.tSemEntry.hSem) == OK ? 0 : 1;
    case e_evt:
      printf("event, set\n");
      return semGive(ptEntry->u.tEvtEntry.hEvt) == OK ? 0 : 1;
  }
  return 1;
}

int main(int argc, char** argv) {
  objEntry_t* ptEntry;
  int result;
  if (argc != 2) return 2;
  if (g_PlcObjTab == NULL || g_PlcObjTab->ulVersion != OBJTAB_VERSION) {
    fprintf(stderr, "no object table\n");
    return 1;
  }
  if (semTake(g_PlcObjTab->hSem, WAIT_FOREVER) != OK) return 1;
  ptEntry = find_object(argv[1]);
  result = ptEntry == NULL ? 3 : use_object(ptEntry);
  semGive(g_PlcObjTab->hSem);
  return result;
}
