/* The tape, in read-only data. CAIRN_TAPE is its file. */
    .section .rodata.tape, "a"
    .balign 16
    .globl cairn_tape_begin, cairn_tape_end
cairn_tape_begin:
    .incbin CAIRN_TAPE
cairn_tape_end:
    .byte 0
    .section .note.GNU-stack, "", %progbits
