// Embree as a peer: camera rays against a mesh, and shadow rays from their hits, one by one and in packets of 8, on one
// thread, with robust intersection.
// usage: embree_peer MESH (float32 x 9 a triangle) VIEW (15 doubles: eye, corner, right, up, towards the light) SIDE ROUNDS
// prints: CPU seconds of the fastest round of camera rays one by one and in packets, the same with shadow rays; hits of
// both, hits in the dark of both

#include <embree3/rtcore.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

static double cpu() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int count, char** arguments) {
    if (count != 5) return 2;
    std::ifstream file(arguments[1], std::ios::binary | std::ios::ate);
    std::vector<float> corners(file.tellg() / sizeof(float));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(corners.data()), corners.size() * sizeof(float));
    std::ifstream view(arguments[2]);
    double c[15];
    for (double& x : c) view >> x;
    const int side = std::atoi(arguments[3]), rounds = std::atoi(arguments[4]);

    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const size_t faces = corners.size() / 9;
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * faces));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, faces));
    for (size_t k = 0; k < corners.size(); k++) vertices[k] = corners[k];
    for (size_t k = 0; k < 3 * faces; k++) indices[k] = unsigned(k);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcCommitScene(scene);

    auto direction = [&](int i, int j, float* d) {
        double v[3], square = 0;
        for (int k = 0; k < 3; k++) {
            v[k] = c[3 + k] + i * c[6 + k] + j * c[9 + k];
            square += v[k] * v[k];
        }
        for (int k = 0; k < 3; k++) d[k] = float(v[k] / std::sqrt(square));
    };
    // Where a shadow ray starts: the hit, off the surface on the eye's side.
    auto start = [&](const float* d, float t, const float* n, float* from) {
        const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        const float side = n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0 ? -1e-4f : 1e-4f;
        for (int k = 0; k < 3; k++) from[k] = float(c[k]) + t * d[k] + side / length * n[k];
    };
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    // Tiles of 4 x 2, in the order in which the packets go.
    auto one_by_one = [&](bool shadows, long& hits, long& dark) {
        const double before = cpu();
        hits = dark = 0;
        for (int j = 0; j < side; j += 2)
            for (int i = 0; i < side; i += 4)
                for (int k = 0; k < 8; k++) {
                    RTCRayHit ray{};
                    float d[3], from[3];
                    direction(i + k % 4, j + k / 4, d);
                    ray.ray.org_x = float(c[0]), ray.ray.org_y = float(c[1]), ray.ray.org_z = float(c[2]);
                    ray.ray.dir_x = d[0], ray.ray.dir_y = d[1], ray.ray.dir_z = d[2];
                    ray.ray.tfar = INFINITY, ray.ray.mask = -1;
                    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                    rtcIntersect1(scene, &context, &ray);
                    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
                    hits++;
                    if (!shadows) continue;
                    const float n[3] = {ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z};
                    start(d, ray.ray.tfar, n, from);
                    RTCRay shadow{};
                    shadow.org_x = from[0], shadow.org_y = from[1], shadow.org_z = from[2];
                    shadow.dir_x = float(c[12]), shadow.dir_y = float(c[13]), shadow.dir_z = float(c[14]);
                    shadow.tfar = INFINITY, shadow.mask = -1;
                    rtcOccluded1(scene, &context, &shadow);
                    dark += shadow.tfar < 0;
                }
        return cpu() - before;
    };
    auto packets = [&](bool shadows, long& hits, long& dark) {
        const double before = cpu();
        hits = dark = 0;
        for (int j = 0; j < side; j += 2)
            for (int i = 0; i < side; i += 4) {
                alignas(32) RTCRayHit8 ray{};
                alignas(32) int valid[8];
                for (int k = 0; k < 8; k++) {
                    float d[3];
                    direction(i + k % 4, j + k / 4, d);
                    valid[k] = -1;
                    ray.ray.org_x[k] = float(c[0]), ray.ray.org_y[k] = float(c[1]), ray.ray.org_z[k] = float(c[2]);
                    ray.ray.dir_x[k] = d[0], ray.ray.dir_y[k] = d[1], ray.ray.dir_z[k] = d[2];
                    ray.ray.tfar[k] = INFINITY, ray.ray.mask[k] = -1;
                    ray.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                }
                rtcIntersect8(valid, scene, &context, &ray);
                alignas(32) RTCRay8 shadow{};
                for (int k = 0; k < 8; k++) {
                    valid[k] = ray.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID ? -1 : 0;
                    hits -= valid[k];
                    if (!shadows || !valid[k]) continue;
                    const float d[3] = {ray.ray.dir_x[k], ray.ray.dir_y[k], ray.ray.dir_z[k]};
                    const float n[3] = {ray.hit.Ng_x[k], ray.hit.Ng_y[k], ray.hit.Ng_z[k]};
                    float from[3];
                    start(d, ray.ray.tfar[k], n, from);
                    shadow.org_x[k] = from[0], shadow.org_y[k] = from[1], shadow.org_z[k] = from[2];
                    shadow.dir_x[k] = float(c[12]), shadow.dir_y[k] = float(c[13]), shadow.dir_z[k] = float(c[14]);
                    shadow.tfar[k] = INFINITY, shadow.mask[k] = -1;
                }
                if (!shadows) continue;
                rtcOccluded8(valid, scene, &context, &shadow);
                for (int k = 0; k < 8; k++) dark += valid[k] && shadow.tfar[k] < 0;
            }
        return cpu() - before;
    };
    double least[4] = {1e30, 1e30, 1e30, 1e30};
    long hits[4], dark[4];
    for (int round = 0; round < rounds; round++)
        for (int way = 0; way < 4; way++) {
            const bool shadows = way >= 2;
            const double took = way % 2 ? packets(shadows, hits[way], dark[way]) : one_by_one(shadows, hits[way], dark[way]);
            least[way] = std::fmin(least[way], took);
        }
    std::printf("%.9f %.9f %.9f %.9f %ld %ld %ld %ld\n", least[0], least[1], least[2], least[3], hits[0], hits[1],
                dark[2], dark[3]);
    return 0;
}
