// The bare page of bench_page.py: only three.js and the same objects as the workbench draws.
// SCENE is "boxes" or "frames". The address contains the size of the canvas.
import * as THREE from "three";

const asked = new URLSearchParams(location.search);
const [width, height] = [Number(asked.get("width")), Number(asked.get("height"))];
const renderer = new THREE.WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
renderer.setPixelRatio(1);
renderer.setSize(width, height);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0x0f1318);
const sun = new THREE.DirectionalLight(0xffffff, 2.1);
const fill = new THREE.DirectionalLight(0xffffff, 0.5);
sun.position.set(1.6, -2.2, 4.5);
fill.position.set(-2, -1, 0.6);
scene.add(new THREE.HemisphereLight(0xe9f1ff, 0x59626e, 1.5), sun, fill);
const camera = new THREE.PerspectiveCamera(32, width / height, 0.05, 2000);
camera.up.set(0, 0, 1);
const surface = (color) => new THREE.MeshStandardMaterial({ color, roughness: 0.62, metalness: 0.05 });

const robot = new THREE.Group();
const part = (geometry, color, x, y, z) => {
  const mesh = new THREE.Mesh(geometry, surface(color));
  mesh.position.set(x, y, z);
  robot.add(mesh);
};
part(new THREE.BoxGeometry(0.001, 0.001, 0.001), 0xffffff, 0, 0, 0.0005);
part(new THREE.BoxGeometry(0.16, 0.16, 0.01), 0x0000cc, -0.02, 0, 0.04);
part(new THREE.CylinderGeometry(0.035, 0.035, 0.005, 64), 0x000000, 0, 0.087, 0.035);
part(new THREE.CylinderGeometry(0.035, 0.035, 0.005, 64), 0x000000, 0, -0.087, 0.035);
part(new THREE.SphereGeometry(0.0175, 48, 32), 0xcc0000, -0.08, 0, 0.0175);
scene.add(robot);

const boxes = (places, [x, y, z]) => {
  const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(x, y, z), surface(0xffffff), places.length);
  mesh.frustumCulled = false;
  const place = new THREE.Matrix4();
  places.forEach((at, i) => mesh.setMatrixAt(i, place.makeTranslation(...at)));
  places.forEach((_, i) => mesh.setColorAt(i, new THREE.Color(0.5, 0.4, 0.3)));
  scene.add(mesh);
};
const FRAMES = 22; // 20 links, map and odom
let away = [9, 4];
if ("SCENE" === "boxes") {
  boxes(BOXES, [0.1, 0.1, 0.1]);
} else {
  away = [1.4, 0.8];
  boxes([[2, 0, 0.2], [-2, 0, 0.2]], [0.1, 4, 0.4]);
  boxes([[0, 2, 0.2], [0, -2, 0.2]], [4, 0.1, 0.4]);
  const rod = new THREE.CylinderGeometry(0.001, 0.001, 0.05, 10);
  const axes = [0xe5484d, 0x46a758, 0x3e7bfa].map((color) => {
    const material = new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true });
    const mesh = new THREE.InstancedMesh(rod, material, FRAMES);
    mesh.frustumCulled = false;
    scene.add(mesh);
    return mesh;
  });
  const place = new THREE.Matrix4();
  setInterval(() => {
    const turned = performance.now() / 1000;
    robot.rotation.z = turned;
    axes.forEach((mesh, which) => {
      for (let i = 0; i < FRAMES; i += 1) {
        place.makeRotationFromEuler(new THREE.Euler(which === 2 ? Math.PI / 2 : 0, 0, which === 0 ? Math.PI / 2 : turned));
        mesh.setMatrixAt(i, place.setPosition(0.1 * Math.cos(turned + i * 0.314), 0.1 * Math.sin(turned + i * 0.314), 0.06));
      }
      mesh.instanceMatrix.needsUpdate = true;
    });
  }, 20);
  const scan = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: 0xff4060, size: 3, sizeAttenuation: false, transparent: true }));
  scan.frustumCulled = false;
  scene.add(scan);
  setInterval(() => {
    const places = new Float32Array(360 * 3);
    for (let i = 0; i < 360; i += 1) {
      const [x, y] = [Math.cos((i * Math.PI) / 180), Math.sin((i * Math.PI) / 180)];
      const reach = 1.95 / Math.max(Math.abs(x), Math.abs(y));
      places.set([x * reach, y * reach, 0.1], i * 3);
    }
    scan.geometry.dispose();
    scan.geometry = new THREE.BufferGeometry();
    scan.geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
  }, 100);
}
// the floor is the last opaque object, so that hidden parts of it are not painted
const far = Math.hypot(...away) * 2 * Math.tan((16 * Math.PI) / 180) * 7;
const floor = new THREE.Mesh(new THREE.CircleGeometry(far, 64), new THREE.MeshBasicMaterial({ color: 0x1b222b, depthWrite: false }));
floor.renderOrder = 1;
scene.add(floor);

window.frames_drawn = 0;
const draw = (now) => {
  camera.position.set(away[0] * Math.cos(now / 2000), away[0] * Math.sin(now / 2000), away[1]);
  camera.lookAt(0, 0, 0);
  renderer.render(scene, camera);
  window.frames_drawn += 1;
  requestAnimationFrame(draw);
};
requestAnimationFrame(draw);
