(** Symmetric matrices of any size: elimination shows that their form is nowhere negative.

    A matrix is the list of its rows from the diagonal on. *)

Require Import Reals Lra List Lia.
From LtlPlan Require Import Vectors Margins.
Import ListNotations.
Open Scope R_scope.

Fixpoint inner (r v : list R) : R :=
  match r, v with b :: r', x :: v' => b * x + inner r' v' | _, _ => 0 end.

Fixpoint rows_form (M : list (list R)) (v : list R) : R :=
  match M, v with
  | (a :: r) :: M', x :: v' => a * (x * x) + 2 * x * inner r v' + rows_form M' v'
  | _, _ => 0
  end.

(** Rows of [n], [n - 1] ... numbers. *)
Fixpoint upper (n : nat) (M : list (list R)) : Prop :=
  match n, M with
  | O, [] => True
  | S m, r :: M' => length r = n /\ upper m M'
  | _, _ => False
  end.

(** ** The algorithm: pivot by pivot; a pivot of zero needs a row of zeros *)

Fixpoint lessened (k : R) (r row : list R) : list R :=
  match r, row with b :: r', m :: row' => (m - k * b) :: lessened k r' row' | _, _ => [] end.

Fixpoint reduced (a : R) (r : list R) (M : list (list R)) : list (list R) :=
  match r, M with b :: r', row :: M' => lessened (b / a) r row :: reduced a r' M' | _, _ => [] end.

Inductive eliminates : list (list R) -> Prop :=
  | eliminates_none : eliminates []
  | eliminates_pivot : forall a r M, 0 < a -> eliminates (reduced a r M) -> eliminates ((a :: r) :: M)
  | eliminates_zero : forall r M, Forall (fun b => b = 0) r -> eliminates M -> eliminates ((0 :: r) :: M).

(** ** Its soundness *)

Lemma inner_lessened : forall k r row v, length r = length row ->
  inner (lessened k r row) v = inner row v - k * inner r v.
Proof.
  induction r as [|b r IH]; intros [|m row] v L; try discriminate; cbn; [ring|].
  destruct v as [|x v]; [ring|]; injection L as L; rewrite IH by auto; ring.
Qed.

Lemma lessened_length : forall k r row, length r = length row -> length (lessened k r row) = length row.
Proof.
  induction r as [|b r IH]; intros [|m row] L; try discriminate; auto; cbn; f_equal.
  injection L as L; auto.
Qed.

Lemma reduced_upper : forall a r M, upper (length r) M -> upper (length r) (reduced a r M).
Proof.
  induction r as [|b r IH]; intros [|row M] U; auto; cbn in U; try contradiction; destruct U as [L U].
  cbn [reduced length upper]; split; [rewrite lessened_length; auto | apply IH; auto].
Qed.

Lemma reduced_form : forall a r M v, a <> 0 -> upper (length r) M ->
  rows_form (reduced a r M) v = rows_form M v - inner r v * inner r v / a.
Proof.
  induction r as [|b r IH]; intros [|row M] v N U; cbn in U; try contradiction.
  - cbn; unfold Rdiv; ring.
  - destruct U as [L U]; destruct row as [|m row]; [discriminate|]; injection L as L.
    destruct v as [|x v]; [cbn; unfold Rdiv; ring|].
    cbn [reduced lessened rows_form inner]; rewrite inner_lessened, IH by auto; field; auto.
Qed.

Lemma inner_zeros : forall r v, Forall (fun b => b = 0) r -> inner r v = 0.
Proof.
  induction r as [|b r IH]; intros [|x v] F; auto; inversion F; subst; cbn; rewrite IH by auto; ring.
Qed.

Theorem elimination_nonneg : forall M, eliminates M -> forall n v, upper n M -> 0 <= rows_form M v.
Proof.
  induction 1 as [|a r M Ha E IH | r M Z E IH]; intros n v U; [cbn; lra | |];
    (destruct n as [|n]; [destruct U|]; destruct U as [L U]; injection L as L; subst n);
    (destruct v as [|x v]; [cbn; lra|]; cbn [rows_form]).
  - specialize (IH (length r) v (reduced_upper a r M U)).
    rewrite reduced_form in IH by (auto; lra).
    pose proof (square_nonneg (x + inner r v / a)) as S.
    apply Rmult_le_compat_l with (r := a) in S; [|lra].
    replace (a * ((x + inner r v / a) * (x + inner r v / a)))
      with (a * (x * x) + 2 * x * inner r v + inner r v * inner r v / a) in S by (field; lra).
    lra.
  - rewrite inner_zeros by auto; specialize (IH (length r) v U); lra.
Qed.

(** ** A square completed: the last pivot is the least value *)

Fixpoint difference (v c : list R) : list R :=
  match v, c with x :: v', y :: c' => (x - y) :: difference v' c' | _, _ => [] end.

(** [ts] are halves of the linear weights, [k] the constant. *)
Inductive completes : list (list R) -> list R -> R -> R -> Prop :=
  | completes_none : forall k, completes [] [] k k
  | completes_pivot : forall a r M t ts k last, 0 < a ->
      completes (reduced a r M) (lessened (t / a) r ts) (k - t * t / a) last ->
      completes ((a :: r) :: M) (t :: ts) k last
  | completes_zero : forall r M ts k last, Forall (fun b => b = 0) r ->
      completes M ts k last -> completes ((0 :: r) :: M) (0 :: ts) k last.

Lemma completes_eliminates : forall M ts k last, completes M ts k last -> eliminates M.
Proof. induction 1; [apply eliminates_none | apply eliminates_pivot | apply eliminates_zero]; auto. Qed.

Lemma inner_difference : forall r v c, length v = length r -> length c = length r ->
  inner r (difference v c) = inner r v - inner r c.
Proof.
  induction r as [|b r IH]; intros [|x v] [|y c] V C; try discriminate; cbn; [ring|].
  injection V as V; injection C as C; rewrite IH by auto; ring.
Qed.

Theorem completed : forall M ts k last, completes M ts k last -> forall n, upper n M -> length ts = n ->
  exists c, length c = n /\ forall v, length v = n ->
    rows_form M v + 2 * inner ts v + k = rows_form M (difference v c) + last.
Proof.
  induction 1 as [k | a r M t ts k last Ha C IH | r M ts k last Z C IH]; intros n U L.
  - exists []; split; auto; intros v _; cbn; ring.
  - destruct n as [|n]; [destruct U|]; destruct U as [Lr U]; injection Lr as Lr; injection L as L; subst n.
    destruct (IH (length r)) as (c & Lc & E).
    { apply reduced_upper; auto. }
    { rewrite lessened_length; auto. }
    exists ((- (inner r c + t) / a) :: c); split; [cbn; auto|]; intros [|x v] Lv; [discriminate|]; injection Lv as Lv.
    specialize (E v Lv); rewrite !reduced_form, inner_lessened in E by (auto; lra).
    cbn [rows_form inner difference]; rewrite inner_difference in * by auto.
    set (A := rows_form M v) in *; set (B := rows_form M (difference v c)) in *.
    set (P := inner r v) in *; set (Q := inner r c) in *; set (T := inner ts v) in *.
    assert (D : B = A - P * P / a + 2 * (T - t / a * P) + (k - t * t / a) + (P - Q) * (P - Q) / a - last) by lra.
    rewrite D; field; lra.
  - destruct n as [|n]; [destruct U|]; destruct U as [Lr U]; injection Lr as Lr; injection L as L; subst n.
    destruct (IH (length r) U L) as (c & Lc & E).
    exists (0 :: c); split; [cbn; auto|]; intros [|x v] Lv; [discriminate|]; injection Lv as Lv.
    specialize (E v Lv); cbn [rows_form inner difference].
    rewrite (inner_zeros r v), (inner_zeros r (difference v c)) by auto; lra.
Qed.

(** ** Forms of points *)

Theorem elimination_semidefinite : forall Q,
  eliminates [[xx Q; xy Q; xz Q]; [yy Q; yz Q]; [zz Q]] -> semidefinite Q.
Proof.
  intros Q E a; pose proof (elimination_nonneg _ E 3 [vx a; vy a; vz a]) as P; cbn in P.
  unfold quad, form, dot, apply; cbn.
  apply Rle_trans with (1 := P ltac:(repeat split)); apply Req_le; ring.
Qed.

(** A quadric around its own centre. *)
Theorem square_completed : forall Q l k last,
  completes [[xx Q; xy Q; xz Q]; [yy Q; yz Q]; [zz Q]] [vx l; vy l; vz l] k last ->
  semidefinite Q /\ exists c, forall a, quad Q a + 2 * dot l a + k = quad Q (sub a c) + last.
Proof.
  intros Q l k last C; split; [apply elimination_semidefinite, (completes_eliminates _ _ _ _ C)|].
  destruct (completed _ _ _ _ C 3) as ([|x [|y [|z [|]]]] & L & E); try discriminate; [cbn; repeat split | auto |].
  exists (Vec x y z); intros a; specialize (E [vx a; vy a; vz a] eq_refl); cbn in E.
  unfold quad, form, dot, apply, sub; cbn; lra.
Qed.
