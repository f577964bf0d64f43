/* Wine 8 lacks what Rust's standard library takes its random numbers from; this hands them on from where Wine has them. */
#include <windows.h>

BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T count) {
    while (count > 0) {
        ULONG piece = count > 0x10000 ? 0x10000 : (ULONG)count;
        if (!SystemFunction036(bytes, piece)) {
            return FALSE;
        }
        bytes += piece;
        count -= piece;
    }
    return TRUE;
}
