// Exclusive prefix sum over the 256 threads of a workgroup.
var<workgroup> scan_cells: array<u32, 256>;

struct Scanned {
    before: u32,
    total: u32,
}

// Call from uniform control flow. Ends with a barrier, so that it can be called again at once.
fn scan_workgroup(thread: u32, value: u32) -> Scanned {
    scan_cells[thread] = value;
    workgroupBarrier();
    for (var step = 1u; step < 256u; step = step << 1u) {
        var sum = scan_cells[thread];
        if thread >= step {
            sum += scan_cells[thread - step];
        }
        workgroupBarrier();
        scan_cells[thread] = sum;
        workgroupBarrier();
    }
    let result = Scanned(scan_cells[thread] - value, scan_cells[255]);
    workgroupBarrier();
    return result;
}
