import { BufferAttribute, BufferGeometry, RepeatWrapping, SRGBColorSpace, Texture } from "three";

/** The triangles of one material of a mesh file. */
export interface MeshPart {
  geometry: BufferGeometry;
  rgba: readonly [number, number, number, number] | null;
  texture: Texture | null;
}

interface Head {
  vertices: number;
  triangles: number;
  rgba: [number, number, number, number] | null;
  /** Size of its texture image in bytes, 0 for none. */
  image: number;
}

const packedMeshes = new Map<string, string>();
const loaded = new Map<string, Promise<MeshPart[]>>();

/** Stores packed meshes by id, in base64, so that they are not fetched from a server. */
export function storeMeshes(packed: Readonly<Record<string, string>>): void {
  for (const [id, text] of Object.entries(packed)) packedMeshes.set(id, text);
}

/** The parts of a mesh by id. Each mesh is fetched once. */
export function mesh(id: string): Promise<MeshPart[]> {
  let parts = loaded.get(id);
  if (parts === undefined) {
    parts = fetchMesh(id);
    loaded.set(id, parts);
    parts.catch(() => loaded.delete(id));
  }
  return parts;
}

async function fetchMesh(id: string): Promise<MeshPart[]> {
  const text = packedMeshes.get(id);
  if (text !== undefined) return unpack(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const answer = await fetch(`./mesh/${id}${location.search}`);
  if (!answer.ok) throw new Error(`mesh ${id}: ${answer.status}`);
  return unpack(await answer.arrayBuffer());
}

/** Unpacks the parts of a mesh from the server's format. */
export function unpack(data: ArrayBuffer): Promise<MeshPart[]> {
  const length = new DataView(data).getUint32(0, true);
  const heads = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Head[];
  let at = 4 + length;
  const floats = (count: number): Float32Array<ArrayBuffer> => {
    const values = new Float32Array(data, at, count);
    at += values.byteLength;
    return values;
  };
  const parts = heads.map(async (head): Promise<MeshPart> => {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(floats(head.vertices * 3), 3));
    const indices = new Uint32Array(data, at, head.triangles * 3);
    at += indices.byteLength;
    geometry.setIndex(new BufferAttribute(indices, 1));
    geometry.computeVertexNormals();
    if (head.image === 0) return { geometry, rgba: head.rgba, texture: null };
    geometry.setAttribute("uv", new BufferAttribute(floats(head.vertices * 2), 2));
    const image = new Blob([new Uint8Array(data, at, head.image)]);
    at += Math.ceil(head.image / 4) * 4;
    return { geometry, rgba: head.rgba, texture: await painted(image) };
  });
  return Promise.all(parts);
}

async function painted(image: Blob): Promise<Texture> {
  const texture = new Texture(await createImageBitmap(image, { imageOrientation: "flipY" }));
  texture.flipY = false; // `imageOrientation` has flipped the bitmap already
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.anisotropy = 4;
  texture.needsUpdate = true;
  return texture;
}
